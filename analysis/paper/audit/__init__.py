"""Are published numbers attainable and consistent? Exact checks of what a paper prints, and the audit of a whole one.

"not attainable" is said by proof only, "attainable" only with data that give the number; else "undecided".
`reconstruct` finds data that meet many printed numbers at once.
"""
