"""Runs in three dimensions: one page of HTML that any browser shows, offline, and notebooks show inline."""

from flagrs.view.page import View, view

__all__ = ["View", "view"]
