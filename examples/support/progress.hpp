/// \file Shows the progress of a run: a bar on a terminal (Boost.Timer), otherwise a line for every tenth of the run.
#pragma once

#include <boost/timer/progress_display.hpp>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <iomanip>
#include <iostream>
#include <optional>
#include <sstream>
#include <string>

#ifdef _WIN32
#include <io.h>
#else
#include <unistd.h>
#endif

namespace example {

/// Whether standard output is a terminal.
inline bool on_terminal() {
#ifdef _WIN32
    return _isatty(_fileno(stdout)) != 0;
#else
    return isatty(STDOUT_FILENO) != 0;
#endif
}

/// "3.1 M", "512 k", "87".
inline std::string readable(double number) {
    const bool millions = number >= 0.9995e6;
    const bool thousands = !millions && number >= 999.5;
    const double scaled = number / (millions ? 1e6 : thousands ? 1e3 : 1.0);
    std::ostringstream text;
    text << std::fixed << std::setprecision(scaled < 9.95 && (millions || thousands) ? 1 : 0) << scaled
         << (millions    ? " M"
             : thousands ? " k"
                         : "");
    return text.str();
}

/// Counts the steps of a run and prints the progress, with the particle-steps per second of the steps done now.
/// advance() may count several steps at once, and ignores steps beyond the last.
class Progress {
public:
    Progress(std::int64_t steps, std::int64_t particles, std::ostream& out = std::cout, bool terminal = on_terminal())
        : steps_(std::max<std::int64_t>(steps, 0)),
          particles_(particles),
          out_(out),
          start_(std::chrono::steady_clock::now()) {
        if (terminal && steps_ > 0) bar_.emplace(static_cast<unsigned long>(steps_), out_, "");
    }

    /// Counts steps that were done before a restart: they are no work of this run.
    void skip(std::int64_t steps) {
        steps = std::clamp<std::int64_t>(steps, 0, steps_ - done_);
        if (steps == 0) return;
        done_ += steps;
        tenth_ = static_cast<int>(10 * done_ / steps_);
        if (bar_) *bar_ += static_cast<unsigned long>(steps);
    }
    /// Leaves time out of the rate, such as that of drawing pictures.
    void leave_out(std::chrono::steady_clock::duration time) { start_ += time; }

    void advance(std::int64_t steps = 1) { advance(steps, particles_); }
    /// \param particles  their number in these steps, where it changes
    void advance(std::int64_t steps, std::int64_t particles) {
        steps = std::clamp<std::int64_t>(steps, 0, steps_ - done_);
        if (steps == 0) return;
        done_ += steps;
        work_ += static_cast<double>(steps) * static_cast<double>(particles);
        if (bar_) {
            *bar_ += static_cast<unsigned long>(steps);
            if (done_ == steps_) out_ << rate() << '\n' << std::flush;
        } else if (const auto tenth = static_cast<int>(10 * done_ / steps_); tenth > tenth_) {
            tenth_ = tenth;
            out_ << "step " << done_ << " of " << steps_ << ", " << rate() << '\n' << std::flush;
        }
    }

private:
    [[nodiscard]] std::string rate() const {
        const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - start_;
        return readable(work_ / std::max(passed.count(), 1e-9)) + " particle-steps/s";
    }

    std::int64_t steps_;
    std::int64_t particles_;
    std::ostream& out_;
    std::chrono::steady_clock::time_point start_;
    std::int64_t done_ = 0;
    double work_ = 0.0;  // particle-steps
    int tenth_ = 0;
    std::optional<boost::timer::progress_display> bar_;
};

}  // namespace example
