"""A buckled strip as a switch: an environment of Gymnasium.

An upright strip carries a mass that buckles it, so that it leans to the left or to the right. A sideways force on the
mass is the action. The agent is to bring the strip to the other side and to let it rest there. The strip is an elastic
rod without mass, in closed form, so that a step of the environment takes some tens of microseconds.

`python switch_env.py` plays a few episodes with a simple controller and prints the steps in a second.
"""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np
import snaprod

try:
    import gymnasium
except ImportError:
    raise SystemExit("switch_env.py needs gymnasium: pip install gymnasium") from None

EULER = np.pi**2 / 4
"""Euler's load of a clamped strip of length 1 and bending stiffness 1."""

SCENE = {
    "rod": {"model": "elastica", "length": 1.0, "bending_stiffness": 1.0},
    "clamp": {"angle": np.pi / 2},
    "body": {"mass": 1.0},
    "loads": {"dead": [0.0, -1.5 * EULER], "drag": 1.0},
    # In equilibrium under the load, leaning to the left: the force is that of the load.
    "start": {"lambda": np.sqrt(1.5 * EULER), "kappa": 0.7},
    "run": {"duration": 1e4, "tolerance": 1e-6, "max_steps": 100000000},
}


class SwitchEnv(gymnasium.Env):
    """The buckled strip. Observation: x, y, vx, vy of the mass, and the side to reach, -1 or 1."""

    def __init__(self, dt: float = 0.02, force: float = 3.0, horizon: int = 500) -> None:
        self.dt, self.force, self.horizon = dt, force, horizon
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (1,))
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (5,))
        self._motion = snaprod.Simulation(SCENE, push=True)

    def _seen(self) -> np.ndarray:
        motion = self._motion
        return np.array([motion["x"], motion["y"], motion["vx"], motion["vy"], self._side], np.float32)

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[np.ndarray, dict[str, Any]]:
        super().reset(seed=seed)
        self._motion.reset()
        self._steps = 0
        self._side = -float(np.sign(self._motion["x"]))
        return self._seen(), {}

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        self._steps += 1
        motion = self._motion
        motion.push((self.force * min(1.0, max(-1.0, float(action[0]))), 0.0))
        motion.advance(self._steps * self.dt)
        there = motion["x"] * self._side > 0.3 and math.hypot(motion["vx"], motion["vy"]) < 0.05
        reward = 10.0 * there - self.dt
        return self._seen(), reward, there, self._steps >= self.horizon, {}


def main() -> None:
    env = SwitchEnv()
    begun, steps = time.perf_counter(), 0
    for episode in range(5):
        seen, _ = env.reset(seed=episode)
        total, done = 0.0, False
        while not done:
            x, _, vx, _, side = seen
            # Push towards the other side until the strip has passed the middle; then brake.
            action = side if x * side < 0.05 else -0.4 * vx
            seen, reward, there, late, _ = env.step(np.array([action]))
            total, done, steps = total + reward, there or late, steps + 1
        print(f"episode {episode}: return {total:.2f} after t = {env._motion.t:.2f}")
    print(f"{steps / (time.perf_counter() - begun):.0f} steps a second")


if __name__ == "__main__":
    main()
