"""Labels of blind cases: locked away, and committed to, before anybody diagnoses."""

from __future__ import annotations

import hashlib
import json
import secrets
from pathlib import Path
from typing import Any

from madelung.errors import InputError
from madelung.files import write_atomically

SCHEMA = "madelung.sealed/1"


def seal(labels: dict[str, Any], path: Path) -> tuple[str, str]:
    """Write labels encrypted (Fernet) to a file.

    Returns
    -------
    The key, which is kept nowhere else, and the SHA-256 (hex) of labels and salt, which binds
    whoever publishes it.
    """
    from cryptography.fernet import Fernet

    salted = json.dumps({"salt": secrets.token_hex(16), "labels": labels}, sort_keys=True).encode()
    key = Fernet.generate_key()
    while key.startswith(b"-"):  # on a command line it would be taken for an option
        key = Fernet.generate_key()
    commitment = hashlib.sha256(salted).hexdigest()
    token = Fernet(key).encrypt(salted).decode()
    content = {"schema": SCHEMA, "sha256": commitment, "token": token}
    write_atomically(path, json.dumps(content, indent=1) + "\n")
    return key.decode(), commitment


def unseal(path: Path, key: str) -> dict[str, Any]:
    """The labels that `seal` wrote.

    Raises
    ------
    InputError
        The file cannot be read, the key does not fit, or the labels are not those that were
        committed to.
    """
    from cryptography.fernet import Fernet, InvalidToken

    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        token, commitment = content["token"], content["sha256"]
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise InputError(f"{path}: is not a file of sealed labels") from error
    try:
        salted = Fernet(key).decrypt(str(token))
    except (InvalidToken, ValueError) as error:
        raise InputError(f"{path}: the key does not open it") from error
    if hashlib.sha256(salted).hexdigest() != commitment:
        raise InputError(f"{path}: the labels are not those that were committed to")
    labels: dict[str, Any] = json.loads(salted)["labels"]
    return labels
