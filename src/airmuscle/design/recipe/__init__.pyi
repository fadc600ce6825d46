from .muscle_recipe import MuscleRecipe as MuscleRecipe
from .prediction import RecipePrediction as RecipePrediction
from .prediction import predict_recipe as predict_recipe
from .rubber_hardness import ModulusRange as ModulusRange
from .rubber_hardness import modulus_of_hardness as modulus_of_hardness
