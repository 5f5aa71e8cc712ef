// The C++ peer of Tipwatch's benchmark `evaluate`: nanoseconds for one pinocchio::rnea on the lab's `rigid` machine,
// free-flyer and every joint, cylinders and rods included. Model and check state come from save_model.py.
//
//     pinocchio_rnea MODEL.txt STATE.txt [repeats]
//
// prints one line of JSON; fails when the check state's torques differ from Python's.
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <random>
#include <vector>

#include <pinocchio/multibody.hpp>
#include <pinocchio/algorithm/joint-configuration.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/serialization.hpp>

using Eigen::VectorXd;

struct State {
    VectorXd q, v, a;
};

static VectorXd read_vector(std::istream &in) {
    Eigen::Index size = 0;
    in >> size;
    VectorXd x(size);
    for (Eigen::Index i = 0; i < size; ++i) in >> x[i];
    return x;
}

static VectorXd random_vector(std::mt19937_64 &generator, Eigen::Index size) {
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    return VectorXd::NullaryExpr(size, [&] { return uniform(generator); });
}

int main(int argc, char **argv) {
    if (argc < 3) {
        std::cerr << "usage: pinocchio_rnea MODEL.txt STATE.txt [repeats]\n";
        return 2;
    }
    const int repeats = argc > 3 ? std::atoi(argv[3]) : 200;
    pinocchio::Model model;
    pinocchio::serialization::loadFromText(model, argv[1]);
    pinocchio::Data data(model);

    std::ifstream file(argv[2]);
    const VectorXd q = read_vector(file), v = read_vector(file), a = read_vector(file), expected = read_vector(file);
    if (!file || q.size() != model.nq || expected.size() != model.nv) {
        std::cerr << "the state file does not fit the model\n";
        return 1;
    }
    const double scale = expected.cwiseAbs().maxCoeff();
    const double difference = (pinocchio::rnea(model, data, q, v, a) - expected).cwiseAbs().maxCoeff() / scale;

    constexpr int count = 1024;
    std::mt19937_64 generator(1);
    std::vector<State> states(count);
    for (State &s : states) {
        s = {random_vector(generator, model.nq), random_vector(generator, model.nv), random_vector(generator, model.nv)};
        pinocchio::normalize(model, s.q);
    }
    double sum = 0.0; // keeps the calls from being optimised away
    std::vector<double> nanoseconds(repeats);
    for (double &ns : nanoseconds) {
        const auto start = std::chrono::steady_clock::now();
        for (const State &s : states) sum += pinocchio::rnea(model, data, s.q, s.v, s.a)[0];
        ns = std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start).count() / count;
    }
    std::sort(nanoseconds.begin(), nanoseconds.end());
    std::cout << "{\"peer\": \"pinocchio c++\", \"version\": \"" << PINOCCHIO_VERSION << "\", \"machine\": \"rigid\", \"joints\": " << model.njoints - 1
              << ", \"nv\": " << model.nv << ", \"states\": " << count << ", \"repeats\": " << repeats << ", \"ns_min\": " << nanoseconds.front()
              << ", \"ns_median\": " << nanoseconds[repeats / 2] << ", \"relative_difference_to_python\": " << difference << ", \"sum\": " << sum << "}\n";
    return difference < 1e-12 ? 0 : 1;
}
