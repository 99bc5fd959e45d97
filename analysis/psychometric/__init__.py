"""Psychometric functions: what the shares of right answers over the levels of a stimulus tell."""
