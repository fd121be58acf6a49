# SPDX-License-Identifier: GPL-3.0-or-later
"""What is drawn over models and UVs: distortion, wrong faces, density, cones, field, seams, pins.

state     what is switched on              refresh   reads meshes that changed, outside of drawing
reading   a mesh as arrays                 draw      the callbacks of the two editors
measures  figures of triangles             legend    what the colours mean
faces, faults, marks, field                read arrays -> shapes to draw
"""
