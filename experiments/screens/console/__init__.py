"""The experimenter's console: a window that says what to do now and keeps every answer. Qt enters here alone."""
