"""An equilibrium as a function of JAX, with the derivatives of snaprod: ``python jax_equilibrium.py``.

JAX traces functions, and does not see into snaprod. A ``jax.custom_jvp`` tells JAX the derivatives that the equilibrium
has by fields of its scene. The functions here work under ``jax.grad`` and ``jax.jit``, through a callback.
"""

import sys

import numpy as np
import snaprod

try:
    import jax
    import jax.numpy as jnp
except ImportError:
    print("jax is not installed, so that this example is skipped: pip install jax")
    sys.exit()

jax.config.update("jax_enable_x64", True)

ROD = {"model": "cosserat", "length": 1.0, "section": {"bending": [1.0, 1.0], "torsion": 1.0}}
SCENE = {"rod": ROD, "end": {"force": [0.5, 0.0, -1.0]}}
FIELDS = ["rod.length", "end.force.0", "end.force.2"]


def solved(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns the place of the end, and its derivatives: a column for each field."""
    found = snaprod.equilibrium(SCENE, by=FIELDS, **dict(zip(FIELDS, map(float, values))))
    columns = [found.derivatives[field]["position"] for field in FIELDS]
    return np.array(found.summary["position"]), np.array(columns).T


SHAPES = jax.ShapeDtypeStruct((3,), float), jax.ShapeDtypeStruct((3, len(FIELDS)), float)


@jax.custom_jvp
def place(values: jax.Array) -> jax.Array:
    """Returns the place of the end for values of the fields."""
    return jax.pure_callback(solved, SHAPES, values)[0]


@place.defjvp
def place_jvp(primals: tuple[jax.Array], tangents: tuple[jax.Array]) -> tuple[jax.Array, jax.Array]:
    """Returns the place of the end and its change."""
    position, slopes = jax.pure_callback(solved, SHAPES, primals[0])
    return position, slopes @ tangents[0]


def miss(values: jax.Array) -> jax.Array:
    """Returns the squared distance of the end from a target."""
    return jnp.sum((place(values) - jnp.array([0.4, 0.0, 0.8])) ** 2)


if __name__ == "__main__":
    values = jnp.array([1.0, 0.5, -1.0])
    descend = jax.jit(jax.value_and_grad(miss))
    for step in range(30):
        off, slope = descend(values)
        if step % 10 == 0:
            print(f"step {step}: {float(off):.3e}")
        values = values - 0.4 * slope
    print(f"length and force {np.round(values, 6)}, off by {float(miss(values)) ** 0.5:.1e}")
