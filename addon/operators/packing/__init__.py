# SPDX-License-Identifier: GPL-3.0-or-later
"""Packing as an operator of its own; what other operators pack goes by way of `operators/layout`."""
