"""Slow judges: what the certificate claims, decided a second time by code that shares nothing with it."""
