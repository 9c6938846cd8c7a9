"""Machines that Drake, Exudyn, DART and Bullet simulate, written as public cases: see README.md in this folder."""
