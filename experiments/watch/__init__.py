"""Who follows runs in progress by their journals: the read-only page, and the markers for other recordings."""
