"""Configs as frozen values."""
