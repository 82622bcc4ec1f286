/// \file A case of the verification suite: what it draws, and the figures that it is held to.
#pragma once

#include <firn/core/json.hpp>
#include <firn/firn.hpp>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace verification {

/// A figure and what it should be.
struct Check {
    std::string quantity;  ///< what, of which variant: "period, APIC, h = 0.5 m [s]"
    double value = 0, reference = 0;
    double tolerance = 0;  ///< of the error
    std::string source;    ///< where reference and tolerance come from
    double floor = 1e-300;

    /// |value − reference| over max(|reference|, floor).
    [[nodiscard]] double error() const { return std::abs(value - reference) / std::max(std::abs(reference), floor); }
    [[nodiscard]] bool holds() const { return error() <= tolerance; }
};

/// A line of a plot. The reference is drawn black and dashed.
struct Curve {
    /// published: points, of an experiment or another code; particles: one point each
    enum class Kind { ours, reference, published, particles };
    std::string label;
    std::vector<double> x{}, y{};
    Kind kind = Kind::ours;

    void add(double at, double value) {
        x.push_back(at);
        y.push_back(value);
    }
};

/// A diagram: one file, CASE_NAME.png.
struct Plot {
    std::string name, title, x_label, y_label;
    bool logarithmic = false;  ///< both axes
    std::vector<Curve> curves{};
};

/// What a program of the suite says: text, plots, figures. `program CASE.json [--quick]` writes it.
class Case {
public:
    /// \param title  one line
    /// \param about  what is computed, with what it is compared, and the source
    Case(int argc, char** argv, std::string title, std::string about)
        : title_(std::move(title)), about_(std::move(about)) {
        for (int i = 1; i < argc; ++i)
            if (std::string_view(argv[i]) == "--quick")
                quick_ = true;
            else if (file_.empty() && argv[i][0] != '-')
                file_ = argv[i];
            else {
                std::cerr << argv[0] << " does not know " << argv[i] << "; it is called as " << argv[0]
                          << " CASE.json [--quick].\n";
                std::exit(2);
            }
    }

    /// Fewer and coarser variants, for a run of seconds.
    [[nodiscard]] bool quick() const { return quick_; }

    Plot& plot(Plot of) {
        plots_.push_back(std::make_unique<Plot>(std::move(of)));
        return *plots_.back();
    }

    /// A figure that the suite holds: the run fails if its error is above the tolerance.
    void check(Check of) {
        std::printf("%-4s %s: %.6g, should be %.6g; error %.2g of %.2g\n", of.holds() ? "ok" : "BAD",
                    of.quantity.c_str(), of.value, of.reference, of.error(), of.tolerance);
        std::fflush(stdout);
        checks_.push_back(std::move(of));
    }

    /// A figure that is 0 at best, and at most `most` from it.
    void at_most(std::string quantity, double value, double most, std::string source) {
        check({std::move(quantity), value, 0, most, std::move(source), 1});
    }

    /// A paragraph below the figures: what others report, what the method does badly, and why.
    void remark(std::string text) { remarks_.push_back(std::move(text)); }

    /// Writes the file. \return what main returns: 1 if a figure is off
    int finish() const {
        bool all_hold = !checks_.empty();
        for (const Check& check : checks_) all_hold = all_hold && check.holds();
        if (!file_.empty()) write();
        return all_hold ? 0 : 1;
    }

private:
    static const char* name_of(Curve::Kind kind) {
        constexpr const char* names[] = {"ours", "reference", "published", "particles"};
        return names[int(kind)];
    }

    void write() const {
        firn::Json json;
        const auto numbers = [&](const char* name, const std::vector<double>& of) {
            json.key(name).array(of, [&](double number) { json.value(number); });
        };
        const auto curve = [&](const Curve& of) {
            json.object([&] {
                json.field("label", of.label).field("kind", name_of(of.kind));
                numbers("x", of.x);
                numbers("y", of.y);
            });
        };
        json.object([&] {
            json.field("title", title_).field("about", about_);
            json.key("remarks").array(remarks_, [&](const std::string& remark) { json.value(remark); });
            json.key("checks").array(checks_, [&](const Check& check) {
                json.object([&] {
                    json.field("quantity", check.quantity).field("value", check.value);
                    json.field("reference", check.reference).field("error", check.error());
                    json.field("tolerance", check.tolerance).field("source", check.source);
                });
            });
            json.key("plots").array(plots_, [&](const auto& plot) {
                json.object([&] {
                    json.field("name", plot->name).field("title", plot->title);
                    json.field("x_label", plot->x_label).field("y_label", plot->y_label);
                    json.field("logarithmic", plot->logarithmic).key("curves").array(plot->curves, curve);
                });
            });
        });
        std::filesystem::create_directories(std::filesystem::absolute(file_).parent_path());
        std::ofstream out(file_);
        out << json.text() << '\n';
        if (!out.flush()) throw firn::io_error("\"" + file_.string() + "\" cannot be written; is the disk full?");
    }

    std::string title_, about_;
    std::filesystem::path file_;
    bool quick_ = false;
    std::vector<std::string> remarks_;
    std::vector<Check> checks_;
    std::vector<std::unique_ptr<Plot>> plots_;
};

/// As printf writes it.
std::string formatted(const char* format, auto... of) {
    char text[256];
    std::snprintf(text, sizeof text, format, of...);
    return text;
}
/// 0.123 is 12.3 %.
inline std::string percent(double of, int decimals = 1) { return formatted("%.*f %%", decimals, 100 * of); }
inline std::string two_decimals(double of) { return formatted("%.2f", of); }

/// The slope of a straight line through (log x, log y), by least squares: an order of convergence.
inline double fitted_order(const std::vector<double>& x, const std::vector<double>& y) {
    double sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        const double a = std::log(x[i]), b = std::log(y[i]);
        sx += a, sy += b, sxx += a * a, sxy += a * b;
    }
    const double n = double(x.size());
    return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

/// f(slot) for every particle of the first material.
template <class Simulation, class F>
void for_particles(const Simulation& simulation, const F& f) {
    const auto& particles = simulation.particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) f(slot);
}

}  // namespace verification
