# SPDX-License-Identifier: GPL-3.0-or-later
"""Islands scaled, turned and made straight: texel density, axes, grids."""
