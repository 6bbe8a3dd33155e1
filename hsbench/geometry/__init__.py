"""Pure functions on arrays: metres, radians, right-handed frames with z up (cameras: x right, y down, z forward).

``a_T_b`` is a (4, 4) matrix that maps b coordinates to a coordinates. Nothing here reads a file.
"""
