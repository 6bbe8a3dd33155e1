"""What simulated lives are like, in numbers.

    hsbench verify --lives 50 --workers 2 --json > lives.json
    python docs/examples/life_statistics.py lives.json

Prints three tables: what is promised of lives, what is done in them, and what was to be done and was not.
"""

import json
import sys
from pathlib import Path


def main(survey: Path) -> None:
    found = json.loads(survey.read_text(encoding="utf-8"))
    measures = found["measures"]
    print("| promise | found |\n|---|---|")
    for line in found["promises"]:
        print(f"| {line['name']} | {line['measured']}{'' if line['kept'] else ' (not kept)'} |")
    hours = measures["seconds"] / 3600
    print(f"\n{found['lives']} lives, {hours:.1f} hours\n\n| event | an hour |\n|---|---|")
    for name, count in sorted(measures["events"], key=lambda row: -row[1]):
        print(f"| {name} | {count / hours:.1f} |")
    print("\n| not done, why | an hour |\n|---|---|")
    for reason, count in sorted(measures["undone"], key=lambda row: -row[1])[:25]:
        print(f"| {reason} | {count / hours:.1f} |")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
