from .episodes_table import load_arm as load_arm
from .identification import DynamicFitSetup as DynamicFitSetup
from .identification import load_dynamic_fit as load_dynamic_fit
from .initial_state import build_initial_conditions as build_initial_conditions
from .prediction import PlantModel as PlantModel
from .prediction import load_plant_model as load_plant_model
from .scenario import TABLES as TABLES
from .scenario import Scenario as Scenario
from .scenario import build_scenario as build_scenario
from .scenario import load_scenario as load_scenario
from .schema import muscle_schema as muscle_schema
from .schema import scenario_schema as scenario_schema
from .simulation_chapter import MAX_DRIVER_SEGMENTS as MAX_DRIVER_SEGMENTS
from .simulation_chapter import describe_input as describe_input
from .write import campaign_scenarios as campaign_scenarios
from .write import save_scenario as save_scenario
from .write import scenario_text as scenario_text

# isort: split
# For the other packages, not in __all__
from .controller import path_keys as path_keys
from .controller import signal_units as signal_units
from .episodes_table import EPISODES as EPISODES
from .episodes_table import arm_file as arm_file
from .episodes_table import arm_record as arm_record
from .episodes_table import is_identified_arm as is_identified_arm
from .scenario import scenario_tables as scenario_tables
