"""Methods of task action-recognition: the classifiers that the source compares, on features of single poses.

Each answer is that of most poses of the track within a second. The source names a support vector machine; the others
and all settings are hsbench defaults.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from hsbench.baselines.affordance360.pose_features import pose_features
from hsbench.baselines.controls.actions import TASK, pooled
from hsbench.baselines.controls.fitted import truth
from hsbench.baselines.method import Method, Predictor, Settings, observed, training
from hsbench.errors import DataError, MissingExtraError
from hsbench.schema.episode import Episode
from hsbench.synth.seeds import Seeds
from hsbench.tasks.action_recognition import LABELS
from hsbench.typing import FloatArray, UInt8Array

FEW, MANY = 3000, 20000  # training poses of each action: where time grows with their square, and elsewhere

Build = Callable[[int], Any]
"""A seed -> an unfitted classifier of scikit-learn."""


def samples(settings: Settings, name: str, most: int) -> tuple[FloatArray, UInt8Array]:
    """((n, F) features, (n,) actions) of poses drawn from train: of each action up to ``most``.

    Of every episode at most its share is drawn, so that long ones do not outweigh the others. Raises DataError where
    there is none.
    """
    data = training(settings, name)
    share, rng = -(-most // len(data)), Seeds(settings.seed).child("classifiers").rng("samples")
    features, actions = [], []
    for episode in data:
        action = np.asarray(truth(episode, TASK).action)
        chosen = [rng.permutation(np.flatnonzero(action == label))[:share] for label in LABELS]
        rows = np.sort(np.concatenate(chosen))
        features.append(pose_features(observed(episode).select(rows), episode.sensor))
        actions.append(action[rows])
    found = np.concatenate(actions)
    if not len(found):
        raise DataError(f"{name} learns what people do; split train has no observed pose whose action is known")
    return np.concatenate(features), found


def _prepare(settings: Settings, name: str, build: Build, most: int) -> Predictor:
    try:
        from sklearn.impute import SimpleImputer
        from sklearn.pipeline import make_pipeline
        from sklearn.preprocessing import StandardScaler
    except ImportError as error:
        raise MissingExtraError(f"method {name}", "scikit-learn", "learn") from error
    features, actions = samples(settings, name, most)
    if (actions == actions[0]).all():
        return lambda episode: np.full(len(observed(episode)), actions[0], dtype=np.uint8)
    known = np.isfinite(features).any(axis=0)  # a skeleton may lack a joint altogether
    model = make_pipeline(SimpleImputer(strategy="median", add_indicator=True), StandardScaler(), build(settings.seed))
    model.fit(features[:, known], actions)

    def predict(episode: Episode) -> UInt8Array:
        poses = observed(episode)
        if not len(poses):
            return np.empty(0, dtype=np.uint8)
        said = model.predict(pose_features(poses, episode.sensor)[:, known]).astype(np.uint8)
        return pooled(said, poses)

    return predict


def _svm_linear(seed: int) -> Any:
    from sklearn.svm import LinearSVC

    return LinearSVC(class_weight="balanced", dual=False, random_state=seed)


def _svm_rbf(seed: int) -> Any:
    from sklearn.svm import SVC

    return SVC(class_weight="balanced", random_state=seed)


def _k_nn(seed: int) -> Any:
    from sklearn.neighbors import KNeighborsClassifier

    return KNeighborsClassifier(n_neighbors=15)


def _forest(seed: int) -> Any:
    from sklearn.ensemble import RandomForestClassifier

    return RandomForestClassifier(200, min_samples_leaf=5, class_weight="balanced", random_state=seed)


def _mlp(seed: int) -> Any:
    from sklearn.neural_network import MLPClassifier

    return MLPClassifier((64, 64), early_stopping=True, random_state=seed)


def _method(name: str, summary: str, build: Build, most: int) -> Method:
    prepare = partial(_prepare, name=name, build=build, most=most)
    return Method(TASK, name, "poses", f"{summary} on offsets and angles of joints", prepare, needs_train=True)


METHODS = (
    _method("svm-linear", "linear support vector machine", _svm_linear, MANY),
    _method("svm-rbf", "support vector machine with a Gaussian kernel", _svm_rbf, FEW),
    _method("k-nn", "15 nearest neighbours", _k_nn, FEW),
    _method("forest", "random forest", _forest, MANY),
    _method("mlp", "network of two hidden layers", _mlp, MANY),
)
