"""What our own methods cost and buy, measured on this machine."""
