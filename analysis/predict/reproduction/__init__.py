"""The paper's two experiments run with synthetic participants, and compared with what was published."""
