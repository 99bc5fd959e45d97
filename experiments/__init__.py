"""The lab: experiments are planned, run and recorded here, and the people behind them kept count of."""
