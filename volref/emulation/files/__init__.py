"""Pipelines and devices in files, sets of pipelines, and questions that make one."""
