"""Drives a run of Atoll: holds a box in the air by pushes that depend on where it is. Usage: python3 drive.py path/to/atoll"""
import json
import subprocess
import sys

run = subprocess.Popen(
    [sys.argv[1], "run", "configs/stack.toml", "--steps", "180", "--quiet", "--commands", "-", "--answers", "-"],
    stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


def say(**line):
    print(json.dumps(line), file=run.stdin, flush=True)


def hear(key):
    return next(answer for answer in map(json.loads, run.stdout) if key in answer)


hear("waits")                                    # nothing moves before it is said how far to go
say(add={"kind": 0, "x": 4, "y": 6}, name="held")
box = hear("added")["added"][0]                  # the name that the run chose
for step in range(1, 181):
    say(body=box)
    state = hear("body")["body"]
    say(force={"id": box, "x": 0, "y": 20 * (6 - state["y"]) - 8 * state["vy"] + 10, "steps": 1})
    say(until=step)                              # one step on
    hear("waits")
print(f"held for 3 s at a height of {state['y']:.2f} m")
run.stdin.close()
run.wait()
