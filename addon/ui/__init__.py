# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the user meets the operators: their table, the menus, the sidebar."""
