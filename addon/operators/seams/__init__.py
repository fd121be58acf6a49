# SPDX-License-Identifier: GPL-3.0-or-later
"""Seams that find themselves, as marks; maps along such seams are `operators/unwrap`."""
