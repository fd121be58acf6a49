# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators for maps that exist: less distortion, and no flips."""
