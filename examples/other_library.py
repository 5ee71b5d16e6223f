"""A learner of another library on the environment: Stable-Baselines3's DQN (the extra ``baselines``).

    python examples/other_library.py

It learns where to take ten samples so that they tell the flow, beside chance on the same truths.
"""

from pathlib import Path

import gymnasium
import numpy as np
from stable_baselines3 import DQN  # pyright: ignore[reportMissingImports]

import fieldrl  # registers the environments
from fieldrl.figures import style


def environment(seed: int) -> gymnasium.Env:
    """The paper's first experiment with ten samples; a sample pays for what it tells."""
    overrides = ["steps=10", "reward=information_gain"]
    made = gymnasium.make("fieldrl/Advection-v0", overrides=overrides)
    made = gymnasium.wrappers.RescaleObservation(made, np.float32(-1), np.float32(1))
    made.reset(seed=seed)
    return made


def returns(act, seeds) -> np.ndarray:
    """The return of an episode for each seed, by what chooses actions, (n,)."""
    found, world = [], environment(0)
    for seed in seeds:
        world.action_space.seed(seed)
        observation, _ = world.reset(seed=seed)
        total, over = 0.0, False
        while not over:
            observation, reward, ended, cut, _ = world.step(act(world, observation))
            total, over = total + float(reward), ended or cut
        found.append(total)
    return np.array(found)


def main(folder: Path = Path("outputs/examples"), steps: int = 5_000, episodes: int = 20) -> None:
    """Train, then compare with chance on episodes that were not trained on; draw both."""
    print(f"fieldrl {fieldrl.__version__}: {steps} samples to learn from")
    learner = DQN(
        "MlpPolicy", environment(0), seed=0, learning_starts=min(500, steps // 2), exploration_fraction=0.5,
        policy_kwargs={"net_arch": [64, 64]}, device="cpu",
    )  # fmt: skip
    learner.learn(steps)
    seeds = range(1000, 1000 + episodes)
    each = {
        "chance": returns(lambda world, _: world.action_space.sample(), seeds),
        "DQN": returns(lambda _, seen: int(learner.predict(seen, deterministic=True)[0]), seeds),
    }
    for name, values in each.items():
        print(f"{name}: return {np.median(values):.2f} (median of {episodes} episodes)")
    drawing = style.figure(style.COLUMN, 2.4)
    (axes,) = style.panels(drawing, 1)
    style.open_frame(axes)
    for name, colour in zip(each, (style.GREY, style.BLUE), strict=True):
        axes.plot(np.sort(each[name]), (np.arange(episodes) + 1) / episodes, color=colour, label=name)
    style.label(axes, "Return of an episode", "Share of episodes below")
    style.legend(axes)
    folder.mkdir(parents=True, exist_ok=True)
    drawing.savefig(folder / "other_library.png")


if __name__ == "__main__":
    main()
