"""GLSL as a function of arrays: one statement, computed for each of up to 4096 inputs."""

import numpy as np

from tests.webgl.engine import Job, Pass, Program, Target, Texture

SIDE = 64

PLACE = "attribute vec2 position; void main() { gl_Position = vec4(position, 0.0, 1.0); }"
PLACE_ES3 = "#version 300 es\nin vec2 position; void main() { gl_Position = vec4(position, 0.0, 1.0); }"

# Multiples of 1/64 are exact even where gl_FragCoord is of half precision; samplers are lowp unless said.
BODY = """
precision highp float; precision highp sampler2D;
uniform sampler2D inputs;
{declare}
void main() {{ vec4 x = texture2D(inputs, gl_FragCoord.xy / 64.0), c; {statement} gl_FragColor = c; }}
"""
BODY_ES3 = """#version 300 es
precision highp float; precision highp sampler2D; precision highp sampler3D;
uniform sampler2D inputs;
{declare}
out vec4 color;
void main() {{ vec4 x = texture(inputs, gl_FragCoord.xy / 64.0), c; {statement} color = c; }}
"""


def computed(engine, statement, inputs, textures=None, *, declare="", version=1, output="rgba32f"):
    """Return `c` (N, 4) that the statement makes of each `x`, inputs (N,) or (N, up to 4)."""
    inputs = np.float32(inputs).reshape(len(inputs), -1)
    texels = np.zeros((SIDE * SIDE, 4), np.float32)
    texels[: len(inputs), : inputs.shape[1]] = inputs
    textures = {"inputs": Texture(texels.reshape(SIDE, SIDE, 4), "rgba32f"), **(textures or {})}
    place, body = (PLACE, BODY) if version == 1 else (PLACE_ES3, BODY_ES3)
    program = Program(place, body.format(declare=declare, statement=statement))
    drawn = Pass(program, uniforms={name: name for name in textures}, target="outputs")
    job = Job(SIDE, SIDE, (drawn,), textures, {"outputs": Target(output)}, version=version)
    return engine.run(job)["outputs"][::-1].reshape(-1, 4)[: len(inputs)]
