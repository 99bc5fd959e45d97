"""Log files into tables: reading, checking, maps for other programs' logs, exclusions, tables out."""
