"""Statistics as a page for people: sections, tables, figures. The only place that rounds."""
