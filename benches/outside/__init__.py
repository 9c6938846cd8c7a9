"""Machines simulated by Drake and by Exudyn, written as public cases: see README.md in this folder."""
