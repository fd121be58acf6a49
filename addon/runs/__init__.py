# SPDX-License-Identifier: GPL-3.0-or-later
"""What solves: tasks, and the process they may have."""
