"""The participant's side: a PsychoPy program of its own, and the link through which a console speaks to it.

PsychoPy's long import, blocking waits and crashes stay in that process. `link` is the console's end and imports no
PsychoPy; `__main__` is the program; `messages` is what they say to each other.
"""
