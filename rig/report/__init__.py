"""Figures and pages for people: of a diagnosis, a hunt, a history, a blind check, an identification. A page is a
template beside its module."""
