# SPDX-License-Identifier: GPL-3.0-or-later
"""Islands scaled, turned and straightened: texel density, axes, chains."""
