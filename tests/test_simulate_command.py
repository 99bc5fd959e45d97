"""What `recoil simulate` tells beyond a shot's summary."""

import json
import os
from dataclasses import asdict, fields

import pytest

from analysis.predict.simulate.panels import write_plot
from device.physics import GunParameters, simulate
from device.physics.hand import HandMechanics, compliant_collision, simulate_held
from device.physics.traces import energy_balance
from experiments.load import find, load_gun
from tests import figure_files

pytestmark = pytest.mark.slow


def test_audit_hand_and_stop_are_those_of_the_physics(recoil):
    words = ("--set", "friction_N=0.5", "--audit", "--hand", "stiffness_N_m=800", "--contact-stiffness", "2e5")
    found = json.loads(recoil("simulate", *words, "--json").stdout)
    gun = GunParameters(friction_N=0.5)
    assert found["audit"]["created_J"] == energy_balance(gun).created_J
    held = simulate_held(gun, HandMechanics(stiffness_N_m=800.0), gun.pulse_s + 0.4)
    assert found["hand"]["peak_hand_force_N"] == pytest.approx(held.peak_hand_force_N)
    assert found["hand"]["stiffness_N_m"] == 800.0
    stop = compliant_collision(gun, simulate(gun).impact_speed_m_s, 2e5)
    assert found["contact"]["compliant"]["peak_force_N"] == pytest.approx(stop.peak_force_N)
    assert found["contact"]["rigid"]["peak_force_N"] == pytest.approx(found["summary"]["collision_force_N"])


def test_a_person_is_told_what_the_emf_creates_and_what_was_not_reached(recoil):
    said = recoil("simulate", "--set", "friction_N=1.7", "--audit", "--contact-stiffness", "1e5").stdout
    assert "created_J" in said
    assert "not reciprocal" in said
    assert "net over the cycle" in said
    assert "the magnet does not come home" in said


def test_the_friction_of_the_return_can_be_set(recoil):
    found = json.loads(recoil("simulate", "--set", "return_friction_N=1.12", "--json").stdout)
    expected = simulate(GunParameters(return_friction_N=1.12))
    assert found["parameters"]["return_friction_N"] == 1.12
    assert found["summary"]["reset_end_s"] == expected.reset_end_s


def test_a_vibration_is_told_traced_and_drawn(recoil, tmp_path):
    words = ("simulate", "--method", "vibration", "--trace", "v.csv", "--plot", "v.png", "--json")
    done = recoil(*words, **{figure_files.ASKED: "1"})
    found = json.loads(done.stdout)["summary"]
    assert found["peak_m_s2"] == pytest.approx(1000.0, rel=1e-6)
    assert found["rms_m_s2"] == pytest.approx(257.54)
    lines = (tmp_path / "v.csv").read_text().splitlines()
    assert lines[0] == "time_s,acceleration_m_s2"
    assert max(abs(float(line.split(",")[1])) for line in lines[1:]) == pytest.approx(1000.0, rel=1e-3)
    assert "257.54" in (tmp_path / "v.svg").read_text()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--hand", "soft"), "`assumed`"),
        (("--hand", "stiffness_N_m=hard"), "'hard' is not a number"),
        (("--hand", "enclosure_mass_kg=0"), "enclosure_mass_kg is 0; it must be finite and above 0"),
        (("--contact-stiffness", "nan"), "--contact-stiffness nan"),
        (("--contact-stiffness", "-1"), "above 0"),
        (("--set", "return_friction_N=-1"), "return_friction_N is -1.0"),
        (("--method", "vibration", "--set", "voltage_V=1"), "no force"),
        (("--vary", "friction_N=1,2"), "--table"),
        (("--vary", "friction_N=1,2", "--table", "t.csv", "--audit"), "--audit tells of a single one"),
    ],
)
def test_what_cannot_be_told_is_refused(recoil, words, said):
    done = recoil("simulate", *words)
    assert done.returncode == 2
    assert said in done.stderr
    assert "Traceback" not in done.stderr


def test_the_figure_of_a_shot_names_every_option_also_those_that_are_assumed(tmp_path):
    with figure_files.drawn("svg"):
        write_plot(GunParameters(drive_off="open", return_friction_N=1.12), tmp_path / "shot", "gun, asymmetric-2")
    drawn = (tmp_path / "shot.svg").read_text(encoding="utf-8")
    for words in (
        "gun, asymmetric-2",
        "rigid stop",
        "coil open",
        "drive_off=open",
        "emf=printed",
        "contact_depth_m=0.0005",
    ):
        assert words in drawn
    assert all(f"{one.name}=" in drawn for one in fields(GunParameters))


def test_a_dot_in_a_figures_name_that_begins_no_ending_stays(recoil, tmp_path):
    for name in ("run_1.12", "run_1.14.SVG", "plain.pdf", "shot.v2", "pulse_0.5ms"):
        said = recoil("simulate", "--plot", tmp_path / name).stderr
        assert f"Figure: {tmp_path}/{name.removesuffix('.SVG').removesuffix('.pdf')}.png" in said
    drawn = [path for path in tmp_path.glob("*.*") if path.suffix in (".png", ".svg", ".pdf")]
    assert {path.stem for path in drawn} == {"plain", "run_1.12", "run_1.14", "shot.v2", "pulse_0.5ms"}


@pytest.mark.parametrize("ending", [".png", ".svg", ".pdf"])
@pytest.mark.parametrize("method", ["asymmetric-2", "vibration"])
def test_a_figure_replaces_pictures_of_ours_alone(method, ending, recoil, tmp_path):
    own, asked = tmp_path / "new" / "shot.png", {figure_files.ASKED: "1"}
    for _ in range(2):
        assert recoil("simulate", "--method", method, "--plot", own, **asked).returncode == 0
    assert sorted(path.name for path in own.parent.iterdir()) == ["shot.pdf", "shot.png", "shot.svg"]

    photo = own.with_suffix(ending)
    photo.write_bytes(b"a photo of the lab")
    done = recoil("simulate", "--method", method, "--plot", own, "--trace", tmp_path / "shot.csv")
    assert (done.returncode, f"--plot {photo}: holds something else" in done.stderr) == (2, True)
    assert photo.read_bytes() == b"a photo of the lab"
    assert not (tmp_path / "shot.csv").exists()


@pytest.mark.parametrize(("name", "said"), [("", "is a folder"), ("..", "is a folder"), (".png", "no name but")])
def test_a_figure_needs_a_name(recoil, tmp_path, name, said):
    done = recoil("simulate", "--plot", f"{tmp_path}/{name}")
    assert (done.returncode, said in done.stderr) == (2, True)
    assert list(tmp_path.rglob("*.*")) == []


@pytest.mark.parametrize("change", ["voltage_V=1e308", "voltage_V=1e300"])
def test_a_shot_beyond_any_axis_is_not_drawn(recoil, tmp_path, change):
    done = recoil("simulate", "--set", change, "--plot", tmp_path / "shot.png")
    assert (done.returncode, "no axis holds" in done.stderr) == (2, True)
    assert list(tmp_path.rglob("*.*")) == []


def test_a_step_too_short_for_a_number_is_traced(recoil, tmp_path):
    assert recoil("simulate", "--set", "back_emf_V_s_m=1e308", "--trace", tmp_path / "shot.csv").returncode == 0


def test_who_asks_for_a_figure_of_another_model_hears_which_it_is(recoil, tmp_path):
    words = ("simulate", "--fidelity", "no-inductance", "--hand", "assumed", "--trace", tmp_path / "shot.csv")
    said = recoil(*words).stderr
    assert "full model, enclosure held still, rigid stop; the no-inductance model, --hand: in the numbers alone" in said
    assert "in the numbers alone" not in recoil("simulate", "--trace", tmp_path / "shot.csv").stderr


@pytest.mark.parametrize("method", ["asymmetric-2", "vibration"])
def test_a_trace_makes_its_folder_as_a_figure_does(method, recoil, tmp_path):
    assert recoil("simulate", "--method", method, "--trace", tmp_path / "new" / "shot.csv").returncode == 0
    assert (tmp_path / "new" / "shot.csv").stat().st_size > 1000


def test_a_trace_takes_the_place_of_a_file_alone(recoil, tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for name, why in (("", "is a folder, not a file"), ("pipe", "is a device or a pipe, not a file")):
        done = recoil("simulate", "--trace", tmp_path / name)
        assert (done.returncode, f"{tmp_path / name}: {why}" in done.stderr) == (2, True)
    assert (tmp_path / "pipe").is_fifo()


@pytest.mark.parametrize("ending", [".gif", ".CSV", ".json", ".mp4", ".JP2", ".h5", ".m4v"])
def test_a_figure_of_another_kind_is_refused_with_those_there_are(recoil, tmp_path, ending):
    done = recoil("simulate", "--plot", tmp_path / f"shot{ending}", "--trace", tmp_path / "shot-trace.csv")
    said = f"--plot {tmp_path}/shot{ending}: figures are PNG, SVG and PDF; name one of these, as in shot.png"
    assert (done.returncode, said in done.stderr) == (2, True)
    assert not [*tmp_path.glob("shot*")]


def test_a_course_that_is_given_up_before_the_shot_is_over_says_where(recoil, tmp_path):
    trace, figure, asked = tmp_path / "light.csv", tmp_path / "light.png", {figure_files.ASKED: "1"}
    change = ("--set", "magnet_mass_kg=1e-6", "--set", "resistance_ohm=0.03")
    done = recoil("simulate", *change, "--audit", "--trace", trace, "--plot", figure, **asked)
    assert done.returncode == 0, done.stderr
    end_s = float(trace.read_text(encoding="utf-8").splitlines()[-1].partition(",")[0])
    up_to = f"up to {end_s:.4g} s, where it is more work than is done for a shot"
    assert f"Energy and momentum, full model, {up_to}" in done.stdout
    assert f"--trace and --plot: {up_to}; the numbers may reach further" in done.stderr
    assert "status                   home" in done.stdout
    assert f"followed to {end_s:.4g} s" in figure.with_suffix(".svg").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("option", "number"),
    [("--audit", "voltage_V=1e300"), ("--trace", "inductance_H=1e-310"), ("--plot", "inductance_H=1e-310")],
)
def test_the_course_of_a_shot_beyond_floats_is_refused(recoil, tmp_path, option, number):
    words = [option] if option == "--audit" else [option, str(tmp_path / "shot.png")]
    done = recoil("simulate", "--set", number, *words)
    assert done.returncode == 2
    assert f"{option}: this shot goes beyond what numbers can express; leave {option} out" in done.stderr


def test_a_shot_names_what_is_not_the_papers_and_what_is_assumed(recoil):
    said = recoil("simulate", "--method", "asymmetric-2", "--set", "voltage_V=20", "--set", "emf=reciprocal").stdout
    options = "friction_N 1.12, voltage_V 20, drive_off shorted, emf reciprocal"
    assert said.startswith(f"One shot, model full, {options}\n")


@pytest.mark.parametrize("method", ["asymmetric-2", "vibration"])
def test_beside_a_trace_stands_what_it_was_made_with(method, recoil, tmp_path):
    assert recoil("simulate", "--method", method, "--trace", tmp_path / "t.csv").returncode == 0
    about = json.loads((tmp_path / "t.csv.json").read_text(encoding="utf-8"))
    parameters = load_gun(find("gun")).rendering(method)
    assert about["parameters"] == json.loads(json.dumps(asdict(parameters)))
    assert about["provenance"]["numpy"]


@pytest.mark.parametrize("words", [("--trace",), ("--vary", "friction_N=0.2,0.3", "--table")])
def test_what_somebody_else_has_beside_a_table_is_not_replaced(words, recoil, tmp_path):
    notes = tmp_path / "t.csv.json"
    for _ in range(2):  # what is ours is
        assert recoil("simulate", *words, tmp_path / "t.csv").returncode == 0
    notes.write_text("{}", encoding="utf-8")
    (tmp_path / "t.csv").unlink()
    done = recoil("simulate", *words, tmp_path / "t.csv")
    assert (done.returncode, f"{words[-1]} {notes}: holds something else" in done.stderr) == (2, True)
    assert notes.read_text(encoding="utf-8") == "{}"
    assert not (tmp_path / "t.csv").exists()
