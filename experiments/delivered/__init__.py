"""Was the shot delivered? A sensor beside the gun: its word on each shot, the marks, and the record."""
