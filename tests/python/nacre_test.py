"""import nacre: arrays without copies, factor() and render(), errors, and how they stop."""

import gc
import os
import signal
import tempfile
import threading
import time
import unittest

import nacre
import numpy as np

SCENE = """<scene version="0.6.0"><integrator type="path"/>
<sensor type="perspective">
<transform name="toWorld"><lookat origin="0,0,4" target="0,0,0" up="0,1,0"/></transform>
<sampler type="sobol"><integer name="sampleCount" value="$spp"/></sampler>
<film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="16"/></film>
</sensor><emitter type="constant"><rgb name="radiance" value="0.25, 0.5, 1"/></emitter>
<shape type="sphere"><bsdf type="diffuse"><rgb name="reflectance" value="0, 0, 0"/></bsdf></shape>
</scene>"""


def windows(points=12, core=9):
    """A dataset of two terms: exponentials of two lengths, mixed by place."""
    half = (core - 1) // 2
    v, u = np.mgrid[-half:half + 1, -half:half + 1]
    r = np.hypot(u, v)
    short, long = np.exp(-r / 0.8), 0.3 * np.exp(-r / 2.5)
    j, i = np.mgrid[0:points, 0:points]
    mix = (0.5 + 0.4 * np.sin(i / 2.0) * np.cos(j / 3.0))[:, :, None, None]
    rd = mix * short + (1 - mix) * long
    return np.stack([rd, 0.5 * rd, 0.25 * rd], axis=2).astype(np.float32)


def dataset(**options):
    return nacre.Dataset(windows(**options), pitch_mm=0.5, eta=1.4)


class Arrays(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory(prefix="nacre-python-test-")
        self.addCleanup(self.folder.cleanup)

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def test_dataset_is_seen_not_copied(self):
        data = dataset()
        self.assertEqual(data.rd.shape, (12, 12, 3, 9, 9))
        self.assertFalse(data.rd.flags.owndata)
        data.rd[3, 4, 1, 2, 5] = 7.5
        self.assertEqual(data.rd[3, 4, 1, 2, 5], 7.5)
        self.assertEqual(data.rd.__array_interface__["data"], data.rd.__array_interface__["data"])
        np.testing.assert_array_equal(data.valid, 1)
        np.testing.assert_array_equal(data.sigma, 0)

    def test_an_array_keeps_its_owner(self):
        values = dataset().rd
        gc.collect()
        filler = [np.full(12 * 12 * 3 * 81, 9, np.float32) for _ in range(8)]
        np.testing.assert_array_equal(values, windows())
        del filler

    def test_dataset_through_its_file(self):
        data = dataset()
        data.valid[0, 0, 0, 0, 0] = 0
        data.sigma[:] = 0.125
        data.write(self.path("a.rd.exr"))
        read = nacre.read_dataset(self.path("a.rd.exr"))
        np.testing.assert_array_equal(read.rd[1:], data.rd[1:])
        np.testing.assert_array_equal(read.sigma[1:], 0.125)
        self.assertEqual((read.valid == 0).sum(), 1)
        self.assertEqual((read.pitch_mm, read.eta, read.channels), (0.5, 1.4, ["R", "G", "B"]))

    def test_material(self):
        data = dataset()
        seen = []
        material, summary = nacre.factor(
            data, method="svd", terms=4, bits=32,
            progress=lambda stage, done, total: seen.append((stage, done, total)))
        self.assertTrue(seen)
        self.assertEqual(material.method, "svd")
        self.assertLess(summary["relative_l2"], 1e-3)
        self.assertEqual(material.maps.shape, (3, material.terms, 12, 12))
        self.assertEqual(material.kernels.shape, (3, 1, material.terms, 9, 9))
        # The sum that makes a window, by hand.
        i, j, c = 5, 7, 1
        by_hand = np.tensordot(material.maps[c, :, j, i], material.kernels[c, 0], 1)
        by_hand = np.maximum(by_hand, 0) * material.row_scale[c, j, i]
        np.testing.assert_allclose(material.window(c, i, j), by_hand, rtol=1e-5)
        np.testing.assert_allclose(material.window(c, i, j), data.rd[j, i, c], rtol=0.02)
        np.testing.assert_allclose(
            material.albedo, data.rd.sum(axis=(3, 4)).transpose(2, 0, 1) * 0.25, rtol=1e-4)
        with self.assertRaises(ValueError):  # they depend on each other
            material.maps[0] = 1
        with self.assertRaisesRegex(IndexError, "12 x 12 points"):
            material.window(0, 12, 0)
        material.write(self.path("m.nacre.exr"))
        read = nacre.read_material(self.path("m.nacre.exr"))
        np.testing.assert_array_equal(read.kernels, material.kernels)
        kernels = read.kernels
        del read, material
        gc.collect()
        self.assertTrue(np.isfinite(kernels).all())

    def test_factor_from_file_is_the_same(self):
        data = dataset()
        data.write(self.path("a.rd.exr"))
        here, _ = nacre.factor(data, terms=3)
        there, _ = nacre.factor(self.path("a.rd.exr"), terms=3)
        np.testing.assert_array_equal(here.maps, there.maps)
        np.testing.assert_array_equal(here.kernels, there.kernels)

    def test_image(self):
        values = np.random.default_rng(1).random((5, 7, 3), np.float32)
        image = nacre.Image(values)
        np.testing.assert_array_equal(image.pixels, values)
        image.pixels[2, 3] = (1, 2, 3)
        image.write(self.path("a.exr"))
        (read,) = nacre.read_images(self.path("a.exr"))
        np.testing.assert_array_equal(read.pixels[2, 3], (1, 2, 3))
        np.testing.assert_array_equal(read.pixels[0], values[0])
        self.assertEqual(read.channels, ["R", "G", "B"])
        image.write(self.path("a.png"), exposure_ev=-1)
        with open(self.path("a.png"), "rb") as file:
            self.assertTrue(file.read().startswith(b"\x89PNG"))
        pixels = read.pixels
        del read
        gc.collect()
        np.testing.assert_array_equal(pixels[0], values[0])

    def test_render(self):
        with open(self.path("scene.xml"), "w", encoding="utf-8") as file:
            file.write(SCENE)
        image, summary = nacre.render(
            self.path("scene.xml"), define={"spp": "4"}, aovs=True, seed=3)
        self.assertEqual(image.pixels.shape, (16, 24, 3))
        # A black ball before even light.
        np.testing.assert_allclose(image.pixels[0, 0], (0.25, 0.5, 1), rtol=1e-5)
        np.testing.assert_array_equal(image.pixels[8, 12], 0)
        self.assertEqual(summary["spp"], 4)
        self.assertEqual(summary["aovs"]["samples"].pixels.shape, (16, 24, 1))


class Errors(unittest.TestCase):
    def test_messages(self):
        with self.assertRaisesRegex(nacre.Error, "nowhere.rd.exr"):
            nacre.read_dataset("/nowhere.rd.exr")
        with self.assertRaisesRegex(nacre.BadData, "not.exr"):
            with tempfile.TemporaryDirectory() as folder:
                with open(os.path.join(folder, "not.exr"), "w", encoding="utf-8") as file:
                    file.write("text")
                nacre.read_images(os.path.join(folder, "not.exr"))
        with self.assertRaisesRegex(TypeError, "no option 'term'; it has: method, terms"):
            nacre.factor(dataset(), term=3)
        with self.assertRaisesRegex(TypeError, "terms"):
            nacre.factor(dataset(), terms="many")
        with self.assertRaisesRegex(nacre.UsageError, "terms"):
            nacre.factor(dataset(), terms=5000)
        with self.assertRaises(ValueError):  # what a UsageError is, too
            nacre.factor(dataset(), method="magic")
        with self.assertRaisesRegex(ValueError, "five axes"):
            nacre.Dataset(np.zeros((3, 3)), pitch_mm=1, eta=1)
        with self.assertRaisesRegex(ValueError, "sigma"):
            nacre.Dataset(windows(), pitch_mm=1, eta=1.3, sigma=np.zeros((1, 1, 1, 9, 9)))
        with self.assertRaisesRegex(nacre.BadData, "core"):
            nacre.Dataset(np.zeros((2, 2, 3, 4, 4)), pitch_mm=1, eta=1.3)
        with self.assertRaisesRegex(ValueError, "2 channels"):
            nacre.Image(np.zeros((2, 2, 2), np.float32))

    def test_a_nan_is_named(self):
        data = dataset()
        data.rd[1, 2, 0, 4, 4] = np.nan
        with self.assertRaisesRegex(nacre.BadData, r"\(2, 1\)"):
            nacre.factor(data, terms=2)


class Stopping(unittest.TestCase):
    def test_false_stops(self):
        with self.assertRaises(nacre.Interrupted):
            nacre.factor(dataset(), progress=lambda *state: False)

    def test_what_progress_raises_comes_out(self):
        def fail(stage, done, total):
            raise KeyError("mine")
        with self.assertRaisesRegex(KeyError, "mine"):
            nacre.factor(dataset(), progress=fail)

    def test_ctrl_c(self):
        calls = []

        def press(stage, done, total):
            calls.append(stage)
            if len(calls) == 1:
                os.kill(os.getpid(), signal.SIGINT)
            self.assertLess(len(calls), 2000, "it goes on")
        with self.assertRaises(KeyboardInterrupt):
            nacre.factor(dataset(), progress=press)
        self.assertIs(signal.getsignal(signal.SIGINT), signal.default_int_handler)
        with self.assertRaises(KeyboardInterrupt):  # Python's own handler is back
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(5)

    def test_other_threads_go_on(self):
        # One call waits, in its progress function, for what another thread does.
        done = threading.Event()

        def other():
            nacre.factor(dataset(), terms=2)
            done.set()
        thread = threading.Thread(target=other)

        def wait(stage, count, total):
            if not thread.is_alive() and not done.is_set():
                thread.start()
            done.wait(60)
        nacre.factor(dataset(), terms=2, progress=wait)
        thread.join()
        self.assertTrue(done.is_set())


if __name__ == "__main__":
    unittest.main()
