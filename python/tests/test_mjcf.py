"""Cables of MuJoCo as scenes."""

import numpy as np
import pytest
import snaprod

mujoco = pytest.importorskip("mujoco", reason="needs MuJoCo with composite cables: pip install 'mujoco<4'")
if int(mujoco.__version__.split(".")[0]) >= 4:
    pytest.skip("MuJoCo 4 has no composite cables", allow_module_level=True)


def cable(curve: str = "s", held: str = "none", elements: int = 40, flat: str = "false") -> str:
    return f"""
    <mujoco>
      <extension><plugin plugin="mujoco.elasticity.cable"/></extension>
      <option gravity="0 0 -9.81" timestep="0.004" integrator="implicit"/>
      <worldbody>
        <composite type="cable" curve="{curve}" count="{elements + 1} 1 1" size="1 .2 .5" offset="0 0 1" initial="{held}">
          <plugin plugin="mujoco.elasticity.cable">
            <config key="twist" value="1e7"/><config key="bend" value="2e8"/><config key="flat" value="{flat}"/>
          </plugin>
          <joint kind="main" damping="0.5"/>
          <geom type="capsule" size=".005" density="1000"/>
        </composite>
      </worldbody>
    </mujoco>"""


def test_a_cable_hangs_as_in_mujoco():
    """Catches a wrong stiffness, mass, frame or gravity: MuJoCo's chain tends to the rod as its elements get shorter."""

    def apart(elements: int) -> np.ndarray:
        text = cable(elements=elements)
        model = mujoco.MjModel.from_xml_string(text)
        data = mujoco.MjData(model)
        while data.time < 8.0:
            mujoco.mj_step(model, data)
        assert np.abs(data.qvel).max() < 1e-3
        found = snaprod.equilibrium(snaprod.from_mjcf(text)).summary["position"]
        assert found[2] < 0.5, "the cable hangs down"
        return data.site("S_last").xpos - found

    coarse, fine = apart(10), apart(20)
    assert np.linalg.norm(fine) < 0.6 * np.linalg.norm(coarse), (coarse, fine)
    # The error of the chain is in proportion to the length of its elements.
    assert np.linalg.norm(2.0 * fine - coarse) < 0.01, (coarse, fine)


def test_what_is_no_uniform_cable_is_refused():
    """Catches a cable that is read as something else."""
    for text, words in [
        ("<mujoco><worldbody/></mujoco>", "one cable"),
        (cable(curve="cos(s) s 0"), "of one length"),
        (cable(held="free"), "duration"),
    ]:
        with pytest.raises(ValueError, match=words):
            snaprod.from_mjcf(text)
    scene = snaprod.from_mjcf(cable(held="ball"), duration=0.1)
    assert scene["clamp"]["joint"] == "ball" and scene["rod"]["damping"]["viscosity"][0] == pytest.approx(0.5 / 40)
