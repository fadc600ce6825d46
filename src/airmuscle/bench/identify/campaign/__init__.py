"""Identification of one muscle from all records of a bench campaign."""

from .campaign import STAGES, Campaign, Prediction, identify_campaign
from .creep_stage import CreepStage
from .error_band import ErrorBand
from .fill_records import valve_commands
from .fill_stage import FillStage
from .friction_stage import FrictionStage
from .held_creep import HeldCreep, fit_held_creep, free_of_creep
from .next_experiment import NextExperiment
from .record import CampaignRecord, RecordKind, classify_records
from .release_stage import ReleaseStage
from .stage import LeftOutStage
from .static_stage import StaticStage

__all__ = [
    "STAGES",
    "Campaign",
    "CampaignRecord",
    "CreepStage",
    "ErrorBand",
    "FillStage",
    "FrictionStage",
    "HeldCreep",
    "LeftOutStage",
    "NextExperiment",
    "Prediction",
    "RecordKind",
    "ReleaseStage",
    "StaticStage",
    "classify_records",
    "fit_held_creep",
    "free_of_creep",
    "identify_campaign",
    "valve_commands",
]
