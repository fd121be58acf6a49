# SPDX-License-Identifier: GPL-3.0-or-later
"""Maps that follow their pins while these are moved: Live Pins (docs/match-pins.md)."""
