# Types of the module, for editors and checkers. Units and meaning: docstrings, help(bristle).
import enum
import os
from collections.abc import Mapping, Sequence
from typing import Any, Optional, TypedDict, Union, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

__version__: str
motion_dtype: np.dtype[Any]
response_dtype: np.dtype[Any]

_Structs = np.ndarray[Any, np.dtype[Any]]
_Records = np.recarray[Any, np.dtype[Any]]

class Error(ValueError): ...

class Status(enum.IntFlag):
    ok: int
    unknown_id: int
    repeated_id: int
    bad_input: int
    overload: int

class SnapLength:
    @staticmethod
    def single(length: float) -> SnapLength: ...
    @staticmethod
    def uniform(min: float, max: float) -> SnapLength: ...
    @staticmethod
    def normal(mean: float, deviation: float) -> SnapLength: ...
    @staticmethod
    def lognormal(mean: float, cv: float) -> SnapLength: ...
    @staticmethod
    def exponential(mean: float) -> SnapLength: ...
    @staticmethod
    def table(quantiles: ArrayLike) -> SnapLength: ...
    @property
    def law(self) -> str: ...
    @property
    def mean(self) -> float: ...
    @property
    def cv(self) -> float: ...
    @property
    def longest(self) -> float: ...
    def moment(self, k: int) -> float: ...
    def quantile(self, u: ArrayLike) -> NDArray[np.float64]: ...
    def survival(self, x: ArrayLike) -> NDArray[np.float64]: ...

class Coefficients:
    kinetic: float
    peak: float
    presliding_length: float
    bristles_per_newton: float
    law: str
    rule: str
    damping_per_newton: float
    viscous_friction: float
    stribeck_velocity: float
    damper_decay: str
    residual_share: float
    shared_renewal: float
    kinetic_speed: float
    fall_per_decade: float
    growth_per_decade: float
    ageing_time: float
    ageing_form: str
    speed_strengthening: float
    strengthening_speed: float
    spread: float
    drop: float
    def __init__(
        self,
        *,
        kinetic: float = ...,
        peak: float = ...,
        presliding_length: float = ...,
        bristles_per_newton: float = ...,
        law: str = ...,
        rule: str = ...,
        damping_per_newton: float = ...,
        viscous_friction: float = ...,
        stribeck_velocity: float = ...,
        damper_decay: str = ...,
        residual_share: float = ...,
        shared_renewal: float = ...,
        kinetic_speed: float = ...,
        fall_per_decade: float = ...,
        growth_per_decade: float = ...,
        ageing_time: float = ...,
        ageing_form: str = ...,
        speed_strengthening: float = ...,
        strengthening_speed: float = ...,
        spread: float = ...,
        drop: float = ...,
    ) -> None: ...
    @staticmethod
    def paper() -> Coefficients: ...

class Material:
    bristle_stiffness: float
    bristle_damping: float
    viscous_friction: float
    stribeck_velocity: float
    normal_stiffness: float
    asperity_height_deviation: float
    snap_length: SnapLength
    snap_rule: str
    damper_decay: str
    residual_length: float
    shared_renewal: float
    ageing_form: str
    ageing_strength: float
    ageing_time: float
    speed_strengthening: float
    strengthening_speed: float
    drop: float
    def __init__(
        self,
        *,
        bristle_stiffness: float = ...,
        bristle_damping: float = ...,
        viscous_friction: float = ...,
        stribeck_velocity: float = ...,
        normal_stiffness: float = ...,
        asperity_height_deviation: float = ...,
        snap_length: SnapLength = ...,
        snap_rule: str = ...,
        damper_decay: str = ...,
        residual_length: float = ...,
        shared_renewal: float = ...,
        ageing_form: str = ...,
        ageing_strength: float = ...,
        ageing_time: float = ...,
        speed_strengthening: float = ...,
        strengthening_speed: float = ...,
        drop: float = ...,
    ) -> None: ...
    @overload
    @staticmethod
    def from_coefficients(coefficients: Coefficients) -> Material: ...
    @overload
    @staticmethod
    def from_coefficients(
        *,
        kinetic: float = ...,
        peak: float = ...,
        presliding_length: float = ...,
        bristles_per_newton: float = ...,
        law: str = ...,
        rule: str = ...,
        damping_per_newton: float = ...,
        viscous_friction: float = ...,
        stribeck_velocity: float = ...,
        damper_decay: str = ...,
        residual_share: float = ...,
        shared_renewal: float = ...,
        kinetic_speed: float = ...,
        fall_per_decade: float = ...,
        growth_per_decade: float = ...,
        ageing_time: float = ...,
        ageing_form: str = ...,
        speed_strengthening: float = ...,
        strengthening_speed: float = ...,
        spread: float = ...,
        drop: float = ...,
    ) -> Material: ...
    def coefficients(self, kinetic_speed: float = ...) -> Coefficients: ...
    def validate(self) -> None: ...
    def bristles_in_contact(self, normal_load: float) -> float: ...
    @overload
    def kinetic_coefficient(self) -> float: ...
    @overload
    def kinetic_coefficient(self, speed: float) -> float: ...
    @overload
    def peak_coefficient(self) -> float: ...
    @overload
    def peak_coefficient(self, held: float) -> float: ...
    def strengthening_at(self, speed: float) -> float: ...
    def damping_at(self, speed: float) -> float: ...
    def steady_force(self, speed: float, normal_load: float) -> float: ...

def virgin_deflection(law: SnapLength, rule: str, x_over_mean: ArrayLike) -> NDArray[np.float64]: ...

class PatchOptions:
    max_normal_load: float
    bristles: int
    axes: int
    outputs: str
    precision: str
    step_rule: str
    sampling: str
    seed: int
    key: int
    population: str
    cohorts: int
    resolution: float
    fluctuation: int
    def __init__(
        self,
        *,
        max_normal_load: float = ...,
        bristles: int = ...,
        axes: int = ...,
        outputs: str = ...,
        precision: str = ...,
        step_rule: str = ...,
        sampling: str = ...,
        seed: int = ...,
        key: int = ...,
        population: str = ...,
        cohorts: int = ...,
        resolution: float = ...,
        fluctuation: int = ...,
    ) -> None: ...

def motions(ids: ArrayLike, normal_load: ArrayLike = ...) -> _Records: ...

class Response(np.record):
    id: int
    status: int
    end: NDArray[np.float64]
    elastic: NDArray[np.float64]
    damper: NDArray[np.float64]
    @property
    def mean(self) -> NDArray[np.float64]: ...  # type: ignore[override]
    stiffness: float
    damping: float
    force_limit: float
    @property
    def dissipated(self) -> float: ...
    @property
    def contact_loss(self) -> float: ...
    @property
    def damper_work(self) -> float: ...
    @property
    def snaps(self) -> int: ...

class Responses(_Structs):
    id: NDArray[np.uint64]
    status: NDArray[np.uint32]
    end: NDArray[np.float64]
    elastic: NDArray[np.float64]
    damper: NDArray[np.float64]
    @property
    def mean(self) -> NDArray[np.float64]: ...  # type: ignore[override]
    stiffness: NDArray[np.float64]
    damping: NDArray[np.float64]
    force_limit: NDArray[np.float64]
    @property
    def dissipated(self) -> NDArray[np.float64]: ...
    @property
    def contact_loss(self) -> NDArray[np.float64]: ...
    @property
    def damper_work(self) -> NDArray[np.float64]: ...
    @property
    def snaps(self) -> NDArray[np.uint64]: ...

def responses(size: int) -> Responses: ...

class StepReport:
    @property
    def status(self) -> Status: ...
    @property
    def patches_stepped(self) -> int: ...
    @property
    def tasks(self) -> int: ...
    @property
    def threads(self) -> int: ...
    @property
    def bristles_visited(self) -> int: ...

class _PatchInfo(TypedDict):
    key: int
    bristles: int
    detail: int
    weight: float
    active: float
    normal_load: float
    max_normal_load: float
    memory_bytes: int
    bytes_per_bristle: int
    kernel: str

class PatchBatch:
    def __init__(
        self, *, threads: int = ..., isa: Optional[str] = ..., eager: bool = ..., servo_core: int = ...
    ) -> None: ...
    def __len__(self) -> int: ...
    def add(self, material: Material, options: PatchOptions = ...) -> int: ...
    def add_many(self, count: int, material: Material, options: PatchOptions = ...) -> NDArray[np.uint64]: ...
    def remove(self, id: int) -> None: ...
    def reset(self, ids: ArrayLike) -> None: ...
    def set_material(self, id: int, material: Material) -> None: ...
    def warm_up(self) -> None: ...
    @overload
    def step(self, dt: float, motions: _Structs, responses: _Structs) -> StepReport: ...
    @overload
    def step(self, dt: float) -> StepReport: ...
    def move(self, id: int, dx: float, dy: float, normal_load: float) -> None: ...
    def force(self, id: int) -> Response: ...
    @overload
    def find_force(self, dt: float, motions: _Structs) -> Responses: ...
    @overload
    def find_force(self, dt: float, motions: _Structs, responses: _Structs) -> _Structs: ...
    def info(self, id: int) -> _PatchInfo: ...
    def stored_energy(self, id: int) -> float: ...
    def state_hash(self, id: Optional[int] = ...) -> int: ...
    def read_bristles(
        self, id: int
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]: ...
    def save_state(self) -> bytes: ...
    def restore_state(self, state: bytes) -> None: ...
    @property
    def threads(self) -> int: ...
    @property
    def isa(self) -> str: ...

class Outline:
    full_size_load: float
    def __init__(self, positions: ArrayLike, weights: ArrayLike) -> None: ...
    @staticmethod
    def disc(radius: float, *, pressure: str = ..., rings: int = ..., around: int = ...) -> Outline: ...
    @staticmethod
    def ellipse(
        half_x: float, half_y: float, *, pressure: str = ..., rings: int = ..., around: int = ...
    ) -> Outline: ...
    @staticmethod
    def rectangle(half_x: float, half_y: float, *, pressure: str = ..., nx: int = ..., ny: int = ...) -> Outline: ...
    @property
    def positions(self) -> NDArray[np.float64]: ...
    @property
    def weights(self) -> NDArray[np.float64]: ...
    def __len__(self) -> int: ...

class _ExtendedInfo(TypedDict):
    cells: int
    scale: float
    along: tuple[float, float]
    normal_load: float
    max_normal_load: float
    memory_bytes: int
    kernel: str

class ExtendedPatches:
    def __init__(self, *, threads: int = ..., isa: Optional[str] = ...) -> None: ...
    def __len__(self) -> int: ...
    def add(self, material: Material, outline: Outline, options: PatchOptions = ...) -> int: ...
    def remove(self, id: int) -> None: ...
    def set_material(self, id: int, material: Material) -> None: ...
    def set_scale(self, id: int, scale: float) -> None: ...
    def step(self, dt: float, ids: ArrayLike, motions: ArrayLike) -> dict[str, np.ndarray]: ...
    def find_force(self, dt: float, ids: ArrayLike, motions: ArrayLike) -> dict[str, np.ndarray]: ...
    def info(self, id: int) -> _ExtendedInfo: ...
    def stored_energy(self, id: int) -> float: ...
    def state_hash(self, id: Optional[int] = ...) -> int: ...
    def save_state(self) -> bytes: ...
    def restore_state(self, state: bytes) -> None: ...

class DeadlineMonitor:
    def __init__(self, deadline: float = ..., period: float = ...) -> None: ...
    def record(self, wall: float, cpu: float = ...) -> None: ...
    def record_tick(self, due: float, start: float, end: float, cpu: float = ...) -> None: ...
    def record_skipped(self, ticks: int) -> None: ...
    def pause(self) -> None: ...
    def refresh_events(self) -> None: ...
    def reset(self) -> None: ...
    def snapshot(self) -> DeadlineMonitor: ...
    def percentile(self, share: float) -> float: ...
    @property
    def deadline(self) -> float: ...
    @property
    def period(self) -> float: ...
    @property
    def count(self) -> int: ...
    @property
    def p50(self) -> float: ...
    @property
    def p99(self) -> float: ...
    @property
    def p999(self) -> float: ...
    @property
    def max(self) -> float: ...
    @property
    def mean(self) -> float: ...
    @property
    def jitter_p50(self) -> float: ...
    @property
    def jitter_p99(self) -> float: ...
    @property
    def jitter_max(self) -> float: ...
    @property
    def misses(self) -> int: ...
    @property
    def misses_ours(self) -> int: ...
    @property
    def misses_machine(self) -> int: ...
    @property
    def skipped(self) -> int: ...
    @property
    def longest_run(self) -> int: ...
    @property
    def late_events(self) -> dict[str, int]: ...
    @property
    def worst(self) -> dict[str, Any]: ...
    @staticmethod
    def wall_now() -> float: ...
    @staticmethod
    def cpu_now() -> float: ...

def instruction_sets() -> dict[str, bool]: ...

# What follows is there where the build has the tools (BRISTLE_BUILD_TOOLS).

class FitEstimate:
    @property
    def value(self) -> float: ...
    @property
    def determined(self) -> bool: ...
    @property
    def low(self) -> Optional[float]: ...
    @property
    def high(self) -> Optional[float]: ...
    @property
    def why(self) -> str: ...

class FitResult:
    @property
    def material(self) -> Material: ...
    @property
    def parameters(self) -> dict[str, FitEstimate]: ...
    @property
    def not_determined(self) -> dict[str, FitEstimate]: ...
    @property
    def residual_rms(self) -> float: ...
    @property
    def explained(self) -> float: ...
    @property
    def t(self) -> NDArray[np.float64]: ...
    @property
    def x(self) -> NDArray[np.float64]: ...
    @property
    def load(self) -> NDArray[np.float64]: ...
    @property
    def force(self) -> NDArray[np.float64]: ...
    @property
    def curve(self) -> NDArray[np.float64]: ...
    @property
    def report(self) -> dict[str, Any]: ...
    @property
    def understood(self) -> list[str]: ...
    @property
    def html(self) -> str: ...

@overload
def fit(
    file: Union[str, os.PathLike[str], Sequence[Union[str, os.PathLike[str]]]],
    *,
    load: Optional[float] = ...,
    sign: str = ...,
    law: str = ...,
    rule: str = ...,
    damper_decay: str = ...,
    residual: Optional[float] = ...,
    renewal: Optional[float] = ...,
    columns: Mapping[str, Union[str, int]] = ...,
    units: Mapping[str, str] = ...,
    speed: Optional[float] = ...,
    clip_load: float = ...,
    radius: Optional[float] = ...,
    disc: Optional[float] = ...,
    mass: float = ...,
    compliance: Optional[float] = ...,
    delay: Optional[float] = ...,
) -> FitResult: ...
@overload
def fit(
    t: ArrayLike,
    x: ArrayLike,
    force: ArrayLike,
    load: ArrayLike,
    *,
    sign: str = ...,
    law: str = ...,
    rule: str = ...,
    damper_decay: str = ...,
    residual: Optional[float] = ...,
    renewal: Optional[float] = ...,
    mass: float = ...,
    compliance: Optional[float] = ...,
    delay: Optional[float] = ...,
) -> FitResult: ...

class SceneRun:
    @property
    def t(self) -> NDArray[np.float64]: ...
    @property
    def forces(self) -> dict[str, NDArray[np.float64]]: ...
    @property
    def responses(self) -> dict[str, Responses]: ...
    @property
    def motions(self) -> dict[str, _Records]: ...
    @property
    def state_hash(self) -> int: ...
    @property
    def steps(self) -> int: ...
    @property
    def report(self) -> dict[str, Any]: ...

class Scene:
    def __init__(self, path: Union[str, os.PathLike[str]]) -> None: ...
    @property
    def file(self) -> str: ...
    @property
    def name(self) -> str: ...
    @property
    def description(self) -> str: ...
    @property
    def dt(self) -> float: ...
    @property
    def steps(self) -> int: ...
    @property
    def patches(self) -> list[str]: ...
    @property
    def bodies(self) -> list[str]: ...
    @property
    def materials(self) -> dict[str, Material]: ...
    def run(
        self,
        *,
        steps: Optional[int] = ...,
        threads: Optional[int] = ...,
        isa: Optional[str] = ...,
        bristles: Optional[int] = ...,
        trace: Union[str, os.PathLike[str], None] = ...,
        clip_load: float = ...,
        out_patches: Optional[int] = ...,
    ) -> SceneRun: ...

def run_scene(
    path: Union[str, os.PathLike[str]],
    *,
    steps: Optional[int] = ...,
    threads: Optional[int] = ...,
    isa: Optional[str] = ...,
    bristles: Optional[int] = ...,
    trace: Union[str, os.PathLike[str], None] = ...,
    clip_load: float = ...,
    out_patches: Optional[int] = ...,
) -> SceneRun: ...
class SweepTable:
    @property
    def study(self) -> str: ...
    @property
    def hash(self) -> str: ...
    @property
    def columns(self) -> dict[str, NDArray[Any]]: ...
    @property
    def units(self) -> dict[str, str]: ...
    def __getitem__(self, name: str) -> NDArray[Any]: ...
    def __len__(self) -> int: ...
    def write(self, path: Union[str, os.PathLike[str]]) -> None: ...

def sweep(
    scene: Union[str, os.PathLike[str]],
    vary: Union[Mapping[str, Union[str, Sequence[Any], NDArray[Any]]], Sequence[str]],
    *,
    sample: str = ...,
    points: int = ...,
    repeat: int = ...,
    seed: Optional[int] = ...,
    set: Optional[Mapping[str, Any]] = ...,
    reference: Optional[Mapping[str, Any]] = ...,
    report: Union[str, Sequence[str]] = ...,
    window: Optional[tuple[float, float]] = ...,
    steps: Optional[int] = ...,
    out: Union[str, os.PathLike[str], Sequence[Union[str, os.PathLike[str]]], None] = ...,
    journal: Union[str, os.PathLike[str], None] = ...,
    threads: int = ...,
    isa: Optional[str] = ...,
    client: Optional[Any] = ...,
) -> SweepTable: ...
def experiment(name: str, *, models: Optional[list[str]] = ..., **parameters: Any) -> dict[str, Any]: ...
