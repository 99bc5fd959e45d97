"""The real gun over a serial line: port, link, clocks, and the `Gun` on top. pyserial enters here alone."""
