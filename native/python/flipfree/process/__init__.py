"""Solver calls in a process of their own: it may crash or be killed, and its caller goes on."""
