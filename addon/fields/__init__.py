# SPDX-License-Identifier: GPL-3.0-or-later
"""Field-Aligned Seamless Map: its operator, its command line, and what is drawn over the model."""
