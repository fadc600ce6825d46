"""Request of the recipe of a muscle that is made by hand."""

from ...design.recipe import MuscleRecipe, RecipePrediction, predict_recipe
from ...design.recipe.muscle_recipe import angle_of_turn
from .declaration import RequestError, Where, option, optional, request


@request
class RecipeRequest:
    """What a caliper, a data sheet and a photograph of the braid give."""

    bore: float = option("Inner diameter of the tube, such as '7 mm'.", unit="m")
    wall: float = option("Wall of the tube, such as '1 mm'.", unit="m")
    length: float = option("Length between the crimps, such as '200 mm'.", unit="m")
    pressure: float = option("Greatest pressure: '5 bar' (gauge).", unit="Pa")
    shore: float | None = optional("Shore A hardness of the tube, such as 50.", metavar="NUMBER")
    modulus: float | None = optional(
        "Young's modulus of the tube in place of its hardness, such as '2.5 MPa'.", unit="Pa"
    )
    angle: float | None = optional(
        "Angle between threads and axis of the braid on the tube, such as '25 deg'.", unit="rad"
    )
    turn: float | None = optional(
        "Length of one turn of a thread on the tube in place of the angle, such as '60 mm'.",
        unit="m",
    )
    thread: float | None = optional("Diameter of a thread, such as '0.2 mm'.", unit="m")
    threads: int | None = optional("Number of threads, both directions together.")
    braid_diameter: float | None = optional(
        "Outer diameter of a braid that is wider than the tube, such as '11 mm'.", unit="m"
    )
    ends: float | None = optional(
        "Length at both ends together that does not contract; one diameter by default.", unit="m"
    )

    def check(self, where: Where) -> None:
        """Raise RequestError unless elasticity and angle are stated once each."""
        for names in (("shore", "modulus"), ("angle", "turn")):
            stated = [name for name in names if getattr(self, name) is not None]
            if len(stated) != 1:
                raise RequestError(f"give {where(names[0])} or {where(names[1])}, one of both")

    def recipe(self) -> MuscleRecipe:
        """The recipe. Raises ParameterError."""
        thread = self.thread or 0.0
        middle = self.braid_diameter or self.bore + 2.0 * self.wall + 4.0 * thread
        angle = self.angle
        if angle is None:
            angle = angle_of_turn(self.turn, middle - 2.0 * thread)
        return MuscleRecipe(
            bore=self.bore,
            wall_thickness=self.wall,
            resting_length=self.length,
            braid_angle=angle,
            thread_diameter=thread,
            hardness=self.shore or 0.0,
            modulus=self.modulus or 0.0,
            braid_diameter=self.braid_diameter or 0.0,
            inactive_length=self.ends or 0.0,
            threads=self.threads or 0,
        )

    def predict(self) -> RecipePrediction:
        """The prediction. Raises ParameterError."""
        return predict_recipe(self.recipe(), self.pressure)
