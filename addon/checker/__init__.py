# SPDX-License-Identifier: GPL-3.0-or-later
"""A test pattern on models, and taking it away again with everything as it was."""
