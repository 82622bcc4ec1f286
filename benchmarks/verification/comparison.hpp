/// \file Scenes that come to rest by explicit steps and by load steps, side by side in the report.
#pragma once

#include <firn/implicit.hpp>

#include "case.hpp"
#include "scenes/load_steps.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

namespace verification {

/// Scenes that came to rest twice, by explicit steps with damping and by load steps: errors, and what they took.
class Comparison {
public:
    struct Rest {
        double error = 0;
        Effort effort{};
    };
    void add(std::string scene, const Rest& by_damping, const Rest& by_load_steps) {
        rows_.push_back({std::move(scene), by_damping, by_load_steps});
    }
    /// The largest error by load steps over that by damping.
    double worst() const {
        double worst = 0;
        for (const Row& row : rows_) worst = std::max(worst, std::abs(row.by_load_steps.error / row.by_damping.error));
        return worst;
    }
    /// A table for the report. \param error  what the errors are of
    std::string table(const std::string& error) const {
        std::string text = "| " + error +
                           " | damping | load steps | damping: steps | CPU time [s] | load steps: steps | Newton steps "
                           "| CPU time [s] |\n|---|---:|---:|---:|---:|---:|---:|---:|";
        for (const auto& [scene, a, b] : rows_)
            text +=
                formatted("\n| %s | %.2g | %.2g | %lld | %.2g | %lld | %lld | %.2g |", scene.c_str(), a.error, b.error,
                          a.effort.steps, a.effort.seconds, b.effort.steps, b.effort.newton_steps, b.effort.seconds);
        return text;
    }

private:
    struct Row {
        std::string scene;
        Rest by_damping, by_load_steps;
    };
    std::vector<Row> rows_;
};

}  // namespace verification
