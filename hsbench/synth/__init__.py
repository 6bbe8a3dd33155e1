"""The generator engine: named seeds, rooms, furniture, people, activities, sensors, renderers."""
