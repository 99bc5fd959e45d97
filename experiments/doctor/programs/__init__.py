"""Programs that look at what could crash or hang: each runs in a process of its own and answers with one JSON object.

Only here are Qt, PsychoPy, sound and X libraries imported.
"""
