"""firn for Conan 2: conan create cmake/conan. Programs then require firn/0.2.0 and find it by find_package(firn), with
firn's own targets. Eigen comes from Conan; OpenMP, HDF5 and MPI are those of the machine."""
import re
from pathlib import Path

from conan import ConanFile
from conan.tools.cmake import CMake, CMakeToolchain
from conan.tools.files import copy, load
from conan.tools.layout import basic_layout


class Firn(ConanFile):
    name = "firn"
    description = "The material point method, the physics written once: a header-only C++20 library"
    license = "MIT"
    topics = ("mpm", "material point method", "simulation", "physics", "header-only")
    package_type = "header-library"
    settings = "os", "arch", "compiler", "build_type"
    no_copy_source = True

    def set_version(self):
        text = load(self, Path(self.recipe_folder) / "../../include/firn/version.hpp")
        self.version = ".".join(re.search(rf"VERSION_{part} (\d+)", text)[1] for part in ("MAJOR", "MINOR", "PATCH"))

    def export_sources(self):
        root = Path(self.recipe_folder) / "../.."
        for pattern in ("CMakeLists.txt", "LICENSE", "include/*", "cmake/*.cmake", "cmake/*.in"):
            copy(self, pattern, root, self.export_sources_folder)

    def layout(self):
        basic_layout(self)

    def requirements(self):
        self.requires("eigen/[>=3.4 <4]", transitive_headers=True)

    def package_id(self):
        self.info.clear()

    def generate(self):
        toolchain = CMakeToolchain(self)
        for option in ("TESTS", "EXAMPLES"):
            toolchain.cache_variables[f"FIRN_BUILD_{option}"] = False
        toolchain.generate()

    def package(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.install()

    def package_info(self):
        self.cpp_info.set_property("cmake_find_mode", "none")  # firn brings its own firnConfig.cmake
        self.cpp_info.builddirs = ["share/cmake/firn"]
        self.cpp_info.bindirs = self.cpp_info.libdirs = []
