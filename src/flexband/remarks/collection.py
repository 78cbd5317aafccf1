"""Remarks on many runs: how they are caught in a call, and the worst of each topic in a result."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, replace
from typing import Any

from flexband.remarks.remark import Remark

_caught: ContextVar[list[Remark] | None] = ContextVar("caught", default=None)


@contextmanager
def catch_remarks() -> Iterator[list[Remark]]:
    """Give a list that collects the remarks of this thread, whether they are warned of or not."""
    remarks: list[Remark] = []
    token = _caught.set(remarks)
    try:
        yield remarks
    finally:
        _caught.reset(token)


def catch(remark: Remark) -> None:
    """Add a remark to the list of the call that is under way, if any."""
    if (remarks := _caught.get()) is not None:
        remarks.append(remark)


def as_text(remarks: Iterable[Remark]) -> str:
    """Return the remarks on one run as JSON, "" without remarks."""
    contents = [remark.as_json() for remark in remarks]
    return json.dumps(contents) if contents else ""


def remarks_in(text: str) -> list[Remark]:
    """Return what `as_text` has made; raise `ValueError` if it is of another version."""
    return [Remark.from_json(content) for content in json.loads(text or "[]")]


@dataclass(frozen=True)
class CollectedRemark:
    """The worst remark of a topic, and how many runs have one.

    Attributes
    ----------
    worst : the remark with the largest number.
    runs : number of runs that have one of this topic.
    inputs : of the run with the worst one, in words; "" if it is of no single run.
    """

    worst: Remark
    runs: int
    inputs: str = ""

    def merge(self, other: CollectedRemark) -> CollectedRemark:
        """Merge two remarks: return the worse one, with the runs of both."""
        has_size = [not math.isnan(remark.worst.size) for remark in (self, other)]
        worse = (
            other
            if has_size[1] and not (has_size[0] and self.worst.size >= other.worst.size)
            else self
        )
        return replace(worse, runs=self.runs + other.runs)

    def as_json(self) -> dict[str, Any]:
        """Return it as plain data."""
        about = {"runs": self.runs, "inputs": self.inputs}
        return {**self.worst.as_json(), **{k: v for k, v in about.items() if v}}

    @classmethod
    def from_json(cls, content: Mapping[str, Any]) -> CollectedRemark:
        """Return what `as_json` has made; raise `ValueError` if it is of another version."""
        runs = int(content.get("runs", 0))
        inputs = str(content.get("inputs", ""))
        return cls(Remark.from_json(content), runs, inputs)


def worst_remarks(remarks: Iterable[CollectedRemark]) -> tuple[CollectedRemark, ...]:
    """Return the worst remark of each topic, in the order in which they first came."""
    topics = dict[tuple[str, ...], CollectedRemark]()
    for remark in remarks:
        topic = remark.worst.topic
        topics[topic] = topics[topic].merge(remark) if topic in topics else remark
    return tuple(topics.values())


def remarks_of(*attributes: Mapping[Any, Any]) -> tuple[CollectedRemark, ...]:
    """Return the remarks in the attributes of results, the worst of each topic.

    The attribute is a list of texts, each a `CollectedRemark` as JSON.
    """
    texts = (text for attrs in attributes for text in attrs.get("remarks", ()))
    return worst_remarks(CollectedRemark.from_json(json.loads(text)) for text in texts)


def as_attribute(remarks: Iterable[CollectedRemark]) -> dict[str, list[str]]:
    """Return remarks as an attribute of a result; none without remarks."""
    texts = [json.dumps(remark.as_json()) for remark in worst_remarks(remarks)]
    return {"remarks": texts} if texts else {}


def merge_remarks(*attributes: Mapping[Any, Any]) -> dict[str, list[str]]:
    """Merge the remarks on results in one attribute, for a result that is made of them."""
    return as_attribute(remarks_of(*attributes))
