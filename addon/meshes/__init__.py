# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes of Blender as the solver sees them, and back."""
