/// \file A scene of the page of particles: what the page can ask of it, and what the page draws of it.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/tensor.hpp>

#include <array>
#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

namespace live {

using Point = firn::Vec<double, 3>;

/// A line of sight through a point of the picture.
struct Ray {
    Point from;   ///< the viewer's eye [m]
    Point along;  ///< unit vector
};

/// What the page draws. Positions of 2D scenes have z = 0. A kind is the number of a colour; its fraction makes the
/// colour lighter.
struct Picture {
    std::vector<float> balls;              ///< x, y, z, radius of each ball [m]
    std::vector<float> ball_kinds;         ///< kind of each ball
    std::vector<float> vertices;           ///< x, y, z [m] and unit normal of each vertex of the surfaces
    std::vector<float> vertex_kinds;       ///< kind of each vertex
    std::vector<std::uint32_t> triangles;  ///< three vertices of each triangle
    std::vector<float> rods;               ///< x, y, z of one end, radius, x, y, z of the other end [m], kind
    std::vector<float> pins;            ///< x, y, z of each pinned point and of the held one [m], and 1 if it is held
    std::uint32_t surface_version = 1;  ///< grows with each change of `triangles`
};

/// How the camera looks at a scene, and what the page offers for it.
struct Stage {
    int dimension = 3;
    Point target{}, lower{}, upper{};  ///< centre of the view, and the box of the scene [m]
    double distance = 4;               ///< of the camera [m]
    double yaw = 0, pitch = 0;         ///< of the camera [rad]
    bool is_box = false;               ///< whether the edges of the box are drawn
};

/// One of the page's scenes.
class Scene {
public:
    Scene() = default;
    Scene(const Scene&) = delete;
    Scene& operator=(const Scene&) = delete;
    virtual ~Scene() = default;

    virtual Stage stage() const = 0;
    virtual std::size_t particles() const = 0;
    virtual std::size_t links() const { return 0; }
    virtual double time() const = 0;
    /// Time step [s]: a fraction of a frame of 1/60 s.
    virtual double time_step() const = 0;
    virtual void step() = 0;

    /// Sets a parameter that the page has a control for.
    /// \return whether the scene has this parameter
    virtual bool set(std::string_view name, double value) = 0;

    /// \name Pointer
    /// @{

    /// Takes hold of the point that the ray meets first.
    /// \param slope  how far from the ray the point may be, per distance from the eye [1]
    /// \return whether there was such a point
    virtual bool grab(const Ray&, double) { return false; }
    /// Leads the held point to the ray, in the plane across the line of sight in which it was taken.
    virtual void drag(const Ray&) {}
    virtual void release() {}
    /// Pins the point that the ray meets, or unpins it.
    /// \return 1: pinned; -1: unpinned; 0: there was no such point
    virtual int pin(const Ray&, double) { return 0; }
    /// Cuts the links between two lines of sight. \return their number
    virtual std::size_t cut(const Ray&, const Ray&) { return 0; }
    /// @}

    virtual void draw(Picture& picture) = 0;
    /// The positions of all particles [m].
    virtual std::vector<Point> positions() const = 0;
    /// The two ends of each link, as indices of particles.
    virtual std::vector<std::array<std::uint32_t, 2>> link_ends() const { return {}; }
    /// The index of the held point, or -1.
    virtual std::ptrdiff_t held() const { return -1; }
};

/// Makes a scene by its name: balls, bodies, cloth, pile, fountain, snow or jelly.
/// \param particles  about how many particles; 0: as many as run smoothly
/// \param threads    number of threads
/// \throws firn::parameter_error  if there is no such scene, or if the number is out of range
std::unique_ptr<Scene> make_scene(std::string_view name, std::size_t particles, int threads);

/// Returns `given`, or `usual` if it is 0.
/// \throws firn::parameter_error  if it is not from `least` to `most`
inline std::size_t checked_number(std::string_view scene, std::size_t given, std::size_t usual, std::size_t least,
                                  std::size_t most) {
    if (given == 0) return usual;
    if (given < least || given > most)
        throw firn::parameter_error(firn::sentence("The scene ", scene, " is asked for ", given, " particles; give ",
                                                   least, " to ", most, "."));
    return given;
}

}  // namespace live
