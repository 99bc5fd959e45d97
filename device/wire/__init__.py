"""The gun's language on the wire: lines, frames and words. Pure: it opens no port and knows no volts.

`PROTOCOL.md` beside this file is the language; the modules here are one reading of it, the firmware in C is another.
"""
