"""Complete scene affordance from one 360 video: actions, maps of activity, and what they say of a room."""
