from .body import Body as Body
from .body import BodyRoute as BodyRoute
from .body import read_body as read_body
from .body_file import BodyFile as BodyFile
from .clearance import Clearance as Clearance
from .demand import TensionBalance as TensionBalance
from .demand import TorqueDemand as TorqueDemand
from .demand import balance as balance
from .demand import gravity_demand as gravity_demand
from .demand import motion_demand as motion_demand
from .demand import table_demand as table_demand
from .faults import RouteFault as RouteFault
from .fitting_out import FitOut as FitOut
from .fitting_out import fit_out as fit_out
from .joints import BodyJoint as BodyJoint
from .kinematics import Poses as Poses
from .kinematics import RouteSamples as RouteSamples
from .kinematics import sample_routes as sample_routes
from .poses import read_poses as read_poses
from .route_muscle import RouteDemand as RouteDemand
from .route_muscle import RouteMuscle as RouteMuscle
from .route_muscle import UnservedRoute as UnservedRoute
from .route_muscle import by_number as by_number
from .route_muscle import by_total_length as by_total_length
from .route_muscle import by_volume as by_volume
from .study import BodyStudy as BodyStudy
from .study import study_body as study_body
from .sweep import RouteSweep as RouteSweep
from .sweep import sweep_routes as sweep_routes

# isort: split
# For the other rooms, not in __all__
from .body_file import read_range as read_range
from .signs import read_direction as read_direction
