"""Machines of Drake, Exudyn, DART, Bullet and Jiminy, written as public cases: see README.md in this folder."""
