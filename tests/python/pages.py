"""What pages of the viewer hold."""

import base64
import json
import re

import numpy as np


def content_of(page):
    """What the page's script reads."""
    text = re.search(r"const page = (.*);\n", page.html)[1]
    return json.loads(text.replace("<\\/", "</"))


def floats(content, number, *shape):
    values = np.frombuffer(base64.b64decode(content["blobs"][number]), np.float32)
    return values.reshape(shape)
