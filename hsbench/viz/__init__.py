"""Pictures and pages: draws what the other packages return as data."""
