"""Figure docs/images/recipe.png: predicted isobars of a muscle that is made by hand.

Run it by `python release/figures/make_recipe_figure.py`.
"""

from math import radians
from pathlib import Path

from airmuscle.core import plotting
from airmuscle.design import MuscleRecipe, predict_recipe

IMAGES = Path(__file__).resolve().parents[2] / "docs" / "images"


def main() -> None:
    """Write the figure of the guide of recipes."""
    recipe = MuscleRecipe(7e-3, 1e-3, 0.2, radians(25.0), hardness=50.0)
    plot = predict_recipe(recipe, 5e5).chapter().plots[0]
    path = IMAGES / "recipe.png"
    plotting.save(plot.draw(), path)
    print(f"wrote {path}")


if __name__ == "__main__":
    main()
