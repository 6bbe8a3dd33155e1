"""What people do: a table of activities by what they need, and how long and at which hours they are done.

Things are named by category and by the role of their parts, never by object, so that the table serves any scene.
Durations are log-normal. The hours follow the shape of time-use surveys (Eurostat HETUS 2010: meals at 7-8, 12-13 and
18-20 h, television after 20 h, sleep 23-7 h); medians and weights are ours, chosen so that an hour has variety.
"""

from __future__ import annotations

from dataclasses import dataclass

Peak = tuple[float, float, float]
"""Hour of the day, half width in hours, and how often at the peak against elsewhere."""


@dataclass(frozen=True)
class Activity:
    """One row.

    how: ``wander``, ``stand``, ``talk``, ``beside`` (stand by a thing), ``touch``, ``fetch``, ``sit``, ``lie`` or
    ``leave`` (by the entrance, to come back).
    categories: of what is used; () is any. roles: of the parts that are touched; () is any.
    near: categories of what must be within ``within_m`` of a seat, and in front of it; () is nothing. Of ``fetch``:
    to what things are brought.
    gesture: of ``people.gestures``. hands: the gesture begins with hands on what is touched, or on what is near.
    median_s, spread: of the duration, and the standard deviation of its logarithm.
    weight: how often, against the others, in the hours without a peak. social: others like to join.
    """

    name: str
    how: str
    categories: tuple[str, ...] = ()
    roles: tuple[str, ...] = ()
    near: tuple[str, ...] = ()
    within_m: float = 0.0
    gesture: str = ""
    hands: bool = False
    median_s: float = 20.0
    spread: float = 0.5
    weight: float = 1.0
    peaks: tuple[Peak, ...] = ()
    social: bool = False

    @property
    def is_at_table(self) -> bool:
        """Whether one sits upright for it, with what it needs at hand."""
        return self.how == "sit" and bool(self.near) and self.within_m <= AT_HAND_M


AT_HAND_M = 1.0
TABLES = ("dining_table", "kitchen_island", "coffee_table", "meeting_table", "kitchen_counter")
EASY = ("sofa", "armchair", "ottoman", "bench")
UPRIGHT = ("chair", "office_chair", "stool", "bar_stool", "armchair", "bench", "sofa")
STORES = (
    "bookshelf", "shelf", "sideboard", "dresser", "tv_stand", "filing_cabinet", "shoe_cabinet", "coat_rack",
    "night_stand", "side_table", "wall_cabinet", "bathroom_cabinet",
)  # fmt: skip
MEALS: tuple[Peak, ...] = ((7.5, 1.5, 8.0), (12.5, 1.5, 8.0), (19.0, 1.5, 8.0))
COOKING: tuple[Peak, ...] = ((7.0, 1.0, 5.0), (11.8, 1.2, 8.0), (18.0, 1.5, 8.0))
NIGHT: tuple[Peak, ...] = ((3.0, 5.0, 60.0),)
WORKING: tuple[Peak, ...] = ((10.5, 2.5, 4.0), (15.0, 3.0, 4.0))
EVENING: tuple[Peak, ...] = ((21.0, 2.5, 6.0),)

CATALOGUE: tuple[Activity, ...] = (
    Activity("wander", "wander", median_s=4.0, weight=4.0),
    Activity("stand", "stand", median_s=6.0, weight=2.0),
    Activity("talk", "talk", gesture="talk", median_s=45.0, spread=0.7, weight=4.0, social=True),
    Activity("phone", "stand", gesture="phone", median_s=60.0, spread=0.8, weight=0.6),
    Activity("rest", "sit", categories=(*EASY, "chair", "bed", "object"), median_s=90.0, spread=0.7, weight=1.0),
    Activity(
        "watch_tv", "sit", categories=(*EASY, "chair", "bed"), near=("television",), within_m=6.0, median_s=600.0,
        spread=0.8, weight=1.0, peaks=EVENING, social=True,
    ),
    Activity(
        "eat", "sit", categories=UPRIGHT, near=TABLES, within_m=0.75, gesture="eat", median_s=600.0, spread=0.4,
        weight=0.5, peaks=MEALS, social=True,
    ),
    Activity(
        "drink", "sit", categories=UPRIGHT, near=TABLES, within_m=0.75, gesture="drink", median_s=150.0, spread=0.5,
        weight=1.0, social=True,
    ),
    Activity(
        "work_at_desk", "sit", categories=UPRIGHT, near=("desk",), within_m=0.75, gesture="type", hands=True,
        median_s=900.0, spread=0.8, weight=2.0, peaks=WORKING,
    ),
    Activity(
        "write", "sit", categories=UPRIGHT, near=("desk", *TABLES), within_m=0.75, gesture="write", hands=True,
        median_s=240.0, spread=0.6, weight=0.6, peaks=WORKING,
    ),
    Activity("read", "sit", categories=(*EASY, "bed", "chair"), gesture="read", median_s=420.0, spread=0.7, weight=1.0),
    Activity(
        "meeting", "sit", categories=UPRIGHT, near=("meeting_table",), within_m=0.75, gesture="talk",
        median_s=1200.0, spread=0.5, weight=2.0, peaks=WORKING, social=True,
    ),
    Activity(
        "cook", "touch", categories=("stove", "kitchen_counter", "kitchen_island"), roles=("top", "front"),
        gesture="stir", hands=True, median_s=90.0, spread=0.7, weight=1.0, peaks=COOKING,
    ),
    Activity(
        "wash_up", "touch", categories=("kitchen_counter", "kitchen_island"), roles=("tap",), gesture="wash",
        median_s=60.0, spread=0.6, weight=0.7, peaks=((8.5, 1.0, 4.0), (13.5, 1.0, 4.0), (20.0, 1.0, 4.0)),
    ),
    Activity(
        "use_fridge", "touch", categories=("fridge",), median_s=5.0, weight=1.2, peaks=MEALS,
    ),
    Activity(
        "use_appliance", "touch",
        categories=("washing_machine", "dishwasher", "microwave", "stove", "water_cooler", "kettle"), median_s=6.0,
        weight=0.8,
    ),
    Activity("use_storage", "touch", categories=STORES, median_s=5.0, weight=2.0),
    Activity("use_wardrobe", "touch", categories=("wardrobe",), median_s=8.0, weight=1.0, peaks=((7.0, 1.5, 4.0),)),
    Activity(
        "write_on_board", "touch", categories=("whiteboard",), roles=("board",), gesture="write", hands=True,
        median_s=25.0, spread=0.6, weight=1.5, peaks=WORKING,
    ),
    Activity(
        "wipe", "touch", roles=("top",), gesture="wipe", hands=True, median_s=20.0, spread=0.6, weight=1.0,
        peaks=((10.0, 2.0, 2.0),),
    ),
    Activity("wash_hands", "touch", categories=("washbasin",), roles=("tap",), gesture="wash",
             median_s=15.0, weight=1.2, peaks=MEALS),
    Activity("switch_light", "touch", roles=("switch",), median_s=1.5, weight=1.0, peaks=((7.0, 1.0, 3.0), EVENING[0])),
    Activity("use_thing", "touch", median_s=3.0, weight=1.5),
    Activity("fetch", "fetch", categories=("fridge", *STORES), near=(*TABLES, "desk"), median_s=3.0, weight=1.5,
             peaks=MEALS),
    Activity("look_out", "beside", categories=("window",), within_m=1.3, median_s=12.0, weight=1.0),
    Activity("look_at", "beside", categories=("picture", "mirror", "wall_clock", "bookshelf"), within_m=1.3,
             median_s=6.0, weight=0.6),
    Activity("water_plant", "beside", categories=("plant", "vase"), within_m=0.9, gesture="pour", median_s=12.0,
             weight=0.6, peaks=((9.0, 2.0, 2.0),)),
    Activity("go_out", "leave", median_s=300.0, spread=0.8, weight=0.3, peaks=((8.0, 1.0, 3.0), (17.0, 2.0, 2.0))),
    Activity("use_toilet", "sit", categories=("toilet",), median_s=120.0, spread=0.6, weight=0.5),
    Activity("sleep", "lie", categories=("bed", "bunk_bed"), median_s=14400.0, spread=0.5, weight=0.15, peaks=NIGHT),
    Activity("nap", "lie", categories=("sofa", "bed"), median_s=900.0, spread=0.6, weight=0.25,
             peaks=((14.5, 1.5, 3.0),)),
)  # fmt: skip
"""Every activity of the natural mode."""

EXPLORE = Activity("explore", "wander")
SIT = Activity("sit", "sit")
TOUCH = Activity("touch", "touch")
LOOK = Activity("look", "beside", categories=("window",), within_m=1.3)
