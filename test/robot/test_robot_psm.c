// PSM kinematics against independent evaluations, finite differences, and itself.
#include "omentum/robot.h"
#include "test_alloc.h"
#include "test_files.h"

static const double q_a[6] = {0.3, -0.2, 0.12, 0.5, -0.4, 0.6};
static const double q_b[6] = {-0.7, 0.5, 0.2, -1.2, 0.9, -0.8};
static const double q_zero[6];

// Values of an independent evaluation of the same Denavit-Hartenberg table, nine digits.
static void forward_matches_published_values(void** state) {
    (void)state;
    OmPsm lnd = om_psm_default(OM_LARGE_NEEDLE_DRIVER, om_pose_identity());
    OmPsm pro = om_psm_default(OM_PROGRASP, om_pose_identity());
    const double in[6] = {0, 0, 0.1, 0, 0, 0};
    const struct {
        const OmPsm* psm;
        const double* q;
        OmVec3 p;
    } known[] = {
        {&lnd, q_zero, {0, 0, 0.0065}},
        {&lnd, in, {0, 0, -0.0935}},
        {&lnd, q_a, {0.034105370, 0.025454160, -0.104504397}},
        {&lnd, q_b, {-0.101570079, -0.093384795, -0.130901268}},
        {&pro, q_a, {0.034785467, 0.026282834, -0.105692154}},
        {&pro, q_b, {-0.101098652, -0.094260176, -0.132154849}},
        {&pro, q_zero, {0, 0, 0.0049}},
    };
    for (size_t i = 0; i < sizeof known / sizeof *known; ++i) {
        OmPose tip = om_psm_forward(known[i].psm, known[i].q);
        assert_near(om_distance(tip.p, known[i].p), 0, 1e-9);  // the values have nine digits
    }
    OmMat3 r = om_quat_to_mat3(om_psm_forward(&lnd, q_a).q);
    OmMat3 expect =
        om_mat3_transpose(om_mat3_cols(om_vec3(0.261614256, 0.475174108, 0.840099725),
                                       om_vec3(0.714829259, -0.680239847, 0.162150795),
                                       om_vec3(0.648519168, 0.558106905, -0.517628797)));
    assert_near(om_mat3_norm(om_mat3_add(r, om_mat3_scale(-1, expect))), 0, 3e-9);
    OmMat3 zero = om_quat_to_mat3(om_psm_forward(&lnd, q_zero).q);
    OmMat3 wpi = om_mat3_cols(om_vec3(0, 1, 0), om_vec3(1, 0, 0), om_vec3(0, 0, -1));
    assert_near(om_mat3_norm(om_mat3_add(zero, om_mat3_scale(-1, wpi))), 0, 1e-14);
}

// The limits of the dVRK's patient-side manipulator and its instruments, in the degrees and millimetres of its files.
static void limits_are_the_robots(void** state) {
    (void)state;
    static const double lo[6] = {-91, -53, 0, -260, -80, -80}, hi[6] = {91, 53, 240, 260, 80, 80};
    for (int k = 0; k < 2; ++k) {
        OmPsm psm = om_psm_default(k ? OM_PROGRASP : OM_LARGE_NEEDLE_DRIVER, om_pose_identity());
        for (int i = 0; i < 6; ++i) {
            double unit = i == 2 ? 1e3 : 180 / OM_PI;
            assert_near(unit * psm.q_min[i], lo[i], 0.02);
            assert_near(unit * psm.q_max[i], hi[i], 0.02);
            // What lies a degree or a millimetre inside is reached, what lies as far outside is refused and said.
            if (i == 3) continue;  // more than a turn: another solution is inside
            for (int inside = 0; inside < 2; ++inside) {
                double q[6] = {0.1, 0.1, 0.12, 0.1, 0.1, 0.1}, found[6];
                q[i] = psm.q_max[i] + (inside ? -1 : 1) / unit;
                OmPose tip = om_psm_forward(&psm, q);
                OmStatus status = om_psm_inverse(&psm, tip, q, found);
                if (inside) {
                    assert_int_equal(status, OM_OK);
                    assert_near(found[i], q[i], 1e-9);
                    continue;
                }
                char wanted[64];
                assert_int_equal(status, OM_INVALID);
                snprintf(wanted, sizeof wanted, "%s, its limit is %.1f", i == 2 ? "mm" : "degrees",
                         unit * psm.q_max[i]);
                if (!strstr(om_error_message(), wanted))
                    fail_msg("\"%s\" lacks \"%s\"", om_error_message(), wanted);
            }
        }
        assert_near(psm.jaw_max * 180 / OM_PI, 80, 0.02);
        assert_near(psm.jaw_min * 180 / OM_PI, k ? -20 : -40, 0.02);
    }
}

static void jacobian_matches_finite_differences(void** state) {
    (void)state;
    OmPose base = {{0.1, 0.2, 0.3}, om_quat_axis_angle(om_vec3(1, 2, 3), 0.7)};
    OmPsm psm = om_psm_default(OM_PROGRASP, base);
    const double* qs[2] = {q_a, q_b};
    for (int k = 0; k < 2; ++k) {
        double j[36], h = 1e-6;
        om_psm_jacobian(&psm, qs[k], j);
        for (int i = 0; i < 6; ++i) {
            double lo[6], hi[6];
            memcpy(lo, qs[k], sizeof lo);
            memcpy(hi, qs[k], sizeof hi);
            lo[i] -= h, hi[i] += h;
            OmPose a = om_psm_forward(&psm, lo), b = om_psm_forward(&psm, hi);
            OmVec3 v = om_scale(0.5 / h, om_sub(b.p, a.p));
            OmQuat d = om_quat_mul(b.q, om_quat_conj(a.q));
            if (d.w < 0) d = (OmQuat){-d.x, -d.y, -d.z, -d.w};
            double fd[6] = {v.x, v.y, v.z, d.x / h, d.y / h, d.z / h};
            for (int r = 0; r < 6; ++r)
                assert_near(j[6 * r + i], fd[r], 1e-8);  // h^2 and rounding / h
        }
    }
}

// JHU's own acceptance is 0.001 degrees and 0.005 mm; the closed form does better.
static void inverse_undoes_forward(void** state) {
    (void)state;
    OmRng rng = om_rng_init(5, 0);
    OmPose base = {{0.02, -0.1, 0.11}, om_quat_axis_angle(om_vec3(-1, 0.3, 2), 1.1)};
    OmPsm psm = om_psm_default(OM_PROGRASP, base);
    for (int n = 0; n < 5000; ++n) {
        double q[6], back[6];
        for (int i = 0; i < 6; ++i) q[i] = om_rng_range(&rng, psm.q_min[i], psm.q_max[i]);
        if (q[2] < 0.02) continue;  // the wrist would be behind the remote centre
        assert_ok(om_psm_inverse(&psm, om_psm_forward(&psm, q), q, back));
        for (int i = 0; i < 6; ++i) assert_near(back[i], q[i], i == 2 ? 1e-12 : 1e-9);
    }
    // A joint state recorded in a real cholecystectomy (CRCD data set, CC BY 4.0).
    const double real[6] = {0.40437773876, -0.57100342325, 0.03804740779,
                            2.52403784972, 0.26346309980,  0.34672318006};
    double back[6];
    assert_ok(om_psm_inverse(&psm, om_psm_forward(&psm, real), real, back));
    for (int i = 0; i < 6; ++i) assert_near(back[i], real[i], 1e-10);
}

// A pose that is accepted is the pose that the joints give, for any orientation; one whose jaw points back along the
// shaft is refused.
static void what_is_accepted_is_reached(void** state) {
    (void)state;
    OmRng rng = om_rng_init(7, 0);
    OmPsm psm = om_psm_default(OM_PROGRASP, om_pose_identity());
    int nok = 0, nback = 0;
    for (int n = 0; n < 20000; ++n) {
        double q[6], found[6];
        for (int i = 0; i < 6; ++i) q[i] = om_rng_range(&rng, psm.q_min[i], psm.q_max[i]);
        q[2] = om_rng_range(&rng, 0.06, 0.2);
        q[4] = om_rng_range(&rng, -OM_PI, OM_PI);  // also beyond its limits
        const OmPose wanted = om_psm_forward(&psm, q);
        const OmStatus status = om_psm_inverse(&psm, wanted, q, found);
        if (fabs(q[4]) > OM_PI / 2) {
            assert_status(status, OM_INVALID);
            nback += strstr(om_error_message(), "wrist pitch would be more") != NULL;
        }
        if (status != OM_OK) continue;
        ++nok;
        const OmPose tip = om_psm_forward(&psm, found);
        assert_near(om_distance(tip.p, wanted.p), 0, 1e-9);
        assert_near(fabs(om_quat_mul(om_quat_conj(tip.q), wanted.q).w), 1, 1e-12);
    }
    printf("%d accepted, %d back\n", nok, nback);
    assert_true(nok > 5000 && nback > 10);
}

// Reachable poses turned by up to 30 degrees: where that breaks a limit the way back is one turn that helps, so a turn
// of about this angle is found. Its joints are within their limits and give the turned pose.
static void the_wrist_turns_where_a_joint_forbids(void** state) {
    (void)state;
    OmRng rng = om_rng_init(6, 0);
    OmPsm psm = om_psm_default(OM_PROGRASP, om_pose_identity());
    int nturned = 0, nstraight = 0;
    for (int n = 0; n < 3000; ++n) {
        double q[6], plain[6], found[6], none[6] = {9, 9, 9, 9, 9, 9};
        for (int i = 0; i < 6; ++i) q[i] = om_rng_range(&rng, psm.q_min[i], psm.q_max[i]);
        q[2] = om_rng_range(&rng, 0.06, 0.2);
        const double angle = om_rng_range(&rng, 0, OM_PI / 6);
        const OmVec3 axis = om_vec3(om_rng_range(&rng, -1, 1), om_rng_range(&rng, -1, 1),
                                    om_rng_range(&rng, -1, 1));
        if (om_norm(axis) < 0.1) continue;
        OmPose good = om_psm_forward(&psm, q), wanted = good, turned, kept = om_pose_identity();
        wanted.q = om_quat_mul(good.q, om_quat_axis_angle(om_normalize(axis), angle));
        const OmStatus straight = om_psm_inverse(&psm, wanted, q, plain);
        const OmStatus status = om_psm_inverse_turned(&psm, wanted, OM_PI / 2, q, found, &turned);
        assert_ok(status);
        const double w = fabs(om_quat_mul(om_quat_conj(wanted.q), turned.q).w);
        const double turn = 2 * acos(fmin(1, w));
        OmPose tip = om_psm_forward(&psm, found);
        assert_near(om_distance(tip.p, wanted.p), 0, 1e-9);
        assert_near(fabs(om_quat_mul(om_quat_conj(tip.q), turned.q).w), 1, 1e-12);
        for (int i = 0; i < 6; ++i)
            assert_true(found[i] >= psm.q_min[i] - 1e-9 && found[i] <= psm.q_max[i] + 1e-9);
        if (straight == OM_OK) {
            assert_memory_equal(found, plain, sizeof plain);
            assert_near(turn, 0, 1e-7);
            ++nstraight;
            continue;
        }
        // about an axis at most 28 degrees beside: a little more turn, and up to one step
        assert_true(turn > 4.9 * OM_PI / 180 && turn < 2 * angle + 10.1 * OM_PI / 180);
        ++nturned;
        assert_status(om_psm_inverse_turned(&psm, wanted, 0, q, none, &kept), OM_INVALID);
        assert_true(none[0] == 9 && kept.q.w == 1);
        assert_non_null(strstr(om_error_message(), "its limit is"));
        // a smaller turn is not allowed: none is found, or one within it
        const OmStatus less =
            om_psm_inverse_turned(&psm, wanted, turn - 1 * OM_PI / 180, q, none, &kept);
        assert_int_equal(less, OM_INVALID);
    }
    printf("%d turned, %d not\n", nturned, nstraight);
    assert_true(nturned > 200 && nstraight > 200);
    // no turn makes a shaft longer
    OmPose far_down = {{0, 0.01, -0.4}, om_psm_forward(&psm, q_zero).q}, turned;
    double q[6];
    assert_status(om_psm_inverse_turned(&psm, far_down, OM_PI, q_zero, q, &turned), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "insertion would be"));
}

static void what_is_out_of_reach_is_named(void** state) {
    (void)state;
    OmPsm psm = om_psm_default(OM_LARGE_NEEDLE_DRIVER, om_pose_identity());
    OmPose far_down = {{0, 0.01, -0.4}, om_psm_forward(&psm, q_zero).q};
    double q[6] = {9, 9, 9, 9, 9, 9};
    assert_status(om_psm_inverse(&psm, far_down, q_zero, q), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "insertion would be"));
    assert_non_null(strstr(om_error_message(), "its limit is 240.0"));
    for (int i = 0; i < 6; ++i) assert_near(q[i], 9, 0);
    OmPose aside = {{0, -0.15, -0.02}, far_down.q};
    assert_status(om_psm_inverse(&psm, aside, q_zero, q), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "degrees"));
    OmPose at_rcm = {{0, 0, 0}, far_down.q};
    assert_status(om_psm_inverse(&psm, at_rcm, q_zero, q), OM_INVALID);
}

static void efforts_do_the_work_of_the_tip(void** state) {
    (void)state;
    OmPsm psm = om_psm_default(OM_LARGE_NEEDLE_DRIVER, om_pose_identity());
    OmVec3 force = om_vec3(0.3, -0.2, 0.5), torque = om_vec3(0.01, 0.02, -0.03);
    double effort[6], j[36];
    om_psm_joint_torque(&psm, q_a, force, torque, effort);
    om_psm_jacobian(&psm, q_a, j);
    const double dq[6] = {0.1, -0.2, 0.03, 0.4, 0.5, -0.6};
    double work_joint = 0, work_tip = 0;
    const double w[6] = {force.x, force.y, force.z, torque.x, torque.y, torque.z};
    for (int i = 0; i < 6; ++i) {
        work_joint += effort[i] * dq[i];
        for (int r = 0; r < 6; ++r) work_tip += w[r] * j[6 * r + i] * dq[i];
    }
    assert_near(work_joint, work_tip, 1e-14);
}

static void the_drawn_tool_is_closed_and_ends_at_the_tip(void** state) {
    (void)state;
    OmPsm psm = om_psm_default(OM_PROGRASP, om_pose_identity());
    OmSurface s;
    assert_ok(om_psm_surface(&psm, q_a, 0.0, &s));
    OmVec3 tip = om_psm_forward(&psm, q_a).p;
    double nearest = 1;
    for (int i = 0; i < s.nvert; ++i) nearest = fmin(nearest, om_distance(om_load3(s.x, i), tip));
    assert_below(nearest, 0.0015);
    assert_true(om_surface_volume(&s) > 0);
    // Every directed edge once, its opposite once: closed and consistently oriented.
    for (int t = 0; t < s.ntri; ++t) {
        for (int k = 0; k < 3; ++k) {
            int a = s.tri_vert[3 * t + k], b = s.tri_vert[3 * t + (k + 1) % 3], same = 0,
                opposite = 0;
            for (int u = 0; u < s.ntri; ++u) {
                for (int l = 0; l < 3; ++l) {
                    int c = s.tri_vert[3 * u + l], d = s.tri_vert[3 * u + (l + 1) % 3];
                    same += c == a && d == b;
                    opposite += c == b && d == a;
                }
            }
            assert_int_equal(same, 1);
            assert_int_equal(opposite, 1);
        }
    }
    om_surface_done(&s);
}

static double capsule_distance(const OmPsmCapsule* c, OmVec3 p) {
    OmVec3 axis = om_sub(c->b, c->a);
    double t = om_dot(om_sub(p, c->a), axis) / om_norm2(axis);
    return om_distance(p, om_madd(c->a, fmax(0, fmin(1, t)), axis)) - c->radius;
}

// Every vertex of the drawn tool lies in a capsule, and each capsule has vertices on its surface.
static void capsules_enclose_the_drawn_tool(void** state) {
    (void)state;
    for (int k = 0; k < 6; ++k) {
        OmPsm psm = om_psm_default(
            k % 2 ? OM_PROGRASP : OM_LARGE_NEEDLE_DRIVER,
            (OmPose){om_vec3(0.1, -0.2, 0.3), om_quat_axis_angle(om_vec3(0.6, 0, 0.8), 0.7)});
        const double* q = k < 3 ? q_a : q_b;
        double jaw = 0.3 * (k % 3);
        OmSurface s;
        OmPsmCapsule capsule[OM_PSM_NCAPSULE];
        double nearest[OM_PSM_NCAPSULE] = {1, 1, 1, 1};
        assert_ok(om_psm_surface(&psm, q, jaw, &s));
        om_psm_capsules(&psm, q, jaw, capsule);
        for (int i = 0; i < s.nvert; ++i) {
            double inside = 1;
            for (int c = 0; c < OM_PSM_NCAPSULE; ++c) {
                double d = capsule_distance(&capsule[c], om_load3(s.x, i));
                inside = fmin(inside, d);
                nearest[c] = fmin(nearest[c], fabs(d));
            }
            assert_below(inside, 1e-9);
        }
        for (int c = 0; c < OM_PSM_NCAPSULE; ++c) assert_below(nearest[c], 1e-9);
        om_surface_done(&s);
    }
}

static void refused_memory_leaks_nothing(void** state) {
    (void)state;
    OmPsm psm = om_psm_default(OM_LARGE_NEEDLE_DRIVER, om_pose_identity());
    const OmAllocator failing = {test_alloc_get, test_alloc_free, NULL};
    int64_t alive = om_alloc_alive();
    om_allocator_set(&failing);
    int nfail = 0;
    for (;; ++nfail) {
        OmSurface s;
        test_alloc_countdown = nfail;
        OmStatus status = om_psm_surface(&psm, q_a, 0.2, &s);
        if (status == OM_OK) {
            om_surface_done(&s);
            break;
        }
        assert_int_equal(status, OM_NO_MEMORY);
        assert_int_equal(om_alloc_alive(), alive);
    }
    om_allocator_set(NULL);
    assert_true(nfail > 0);
    assert_int_equal(om_alloc_alive(), alive);
}

// Written again for other joints, a drawing is that of the other joints, byte for byte.
static void the_drawing_follows_the_joints(void** state) {
    (void)state;
    OmPsm psm = om_psm_default(OM_PROGRASP, om_pose_identity());
    OmSurface moved, fresh;
    assert_ok(om_psm_surface(&psm, q_a, 0.1, &moved));
    om_psm_surface_update(&psm, q_b, 0.6, &moved);
    assert_ok(om_psm_surface(&psm, q_b, 0.6, &fresh));
    assert_int_equal(moved.nvert, fresh.nvert);
    assert_memory_equal(moved.x, fresh.x, 3 * (size_t)fresh.nvert * sizeof(double));
    om_surface_done(&moved);
    om_surface_done(&fresh);
}

// The dVRK's own files give the numbers that are written in the source, and those of other instruments.
static void instruments_are_read_from_files(void** state) {
    (void)state;
    OmPsm lnd = om_psm_default(OM_LARGE_NEEDLE_DRIVER, om_pose_identity()), read = lnd;
    read.wrist = 0;
    for (int k = 3; k < 6; ++k) read.q_min[k] = read.q_max[k] = 0;
    assert_ok(om_psm_load_instrument(test_data("dvrk/LARGE_NEEDLE_DRIVER_400006.json"), &read));
    assert_near(read.wrist, lnd.wrist, 0);
    for (int k = 0; k < 6; ++k) {
        assert_near(read.q_min[k], lnd.q_min[k], 1e-9);
        assert_near(read.q_max[k], lnd.q_max[k], 1e-9);
    }
    assert_near(read.jaw_min, lnd.jaw_min, 1e-9);
    assert_ok(om_psm_load_instrument(test_data("dvrk/PROGRASP_FORCEPS_400093.json"), &read));
    assert_near(read.wrist, om_psm_default(OM_PROGRASP, om_pose_identity()).wrist, 0);
    assert_ok(om_psm_load_instrument(test_data("dvrk/CADIERE_FORCEPS_400049.json"), &read));
    assert_near(read.wrist, 0.0091, 0);
    OmPsm before = read;
    assert_status(om_psm_load_instrument(test_data("dvrk/PSM.json"), &read), OM_UNAVAILABLE);
    assert_memory_equal(&read, &before, sizeof read);
    // the arms: the Classic one is built in
    assert_ok(om_psm_load_arm(test_data("dvrk/PSM.json"), &read));
    assert_memory_equal(&read, &before, sizeof read);
    assert_ok(om_psm_load_arm(test_data("dvrk/PSM_Si.json"), &read));
    assert_near(read.insertion, -0.4826, 0);
    assert_near(read.q_max[0], 2.964, 0);
    assert_near(read.q_min[1], -1.265, 0);
    assert_near(read.q_max[2], 0.29, 0);
    before = read;
    assert_status(om_psm_load_arm(test_data("dvrk/PROGRASP_FORCEPS_400093.json"), &read),
                  OM_UNAVAILABLE);
    assert_memory_equal(&read, &before, sizeof read);
}

// An S instrument on an Si arm: the tip at zero is insertion + shaft + wrist below the remote centre, and the inverse
// finds joints back that the Classic arm does not have.
static void a_longer_arm(void** state) {
    (void)state;
    static const char arm[] =
        "{\"DH\": {\"convention\": \"modified\", \"joints\": ["
        "{\"alpha\": 1.5708, \"A\": 0, \"theta\": 0, \"D\": 0, \"offset\": 1.5708, \"qmin\": -2.9, "
        "\"qmax\": 2.9},{\"alpha\": -1.5708, \"A\": 0, \"theta\": 0, \"D\": 0, \"offset\": -1.5708, "
        "\"qmin\": -1.2, \"qmax\": 1.3},{\"alpha\": 1.5708, \"A\": 0, \"theta\": 0, \"D\": 0, "
        "\"offset\": -0.48, \"qmin\": 0, \"qmax\": 0.29}]}}";
    static const char tool[] =
        "{\"DH\": {\"convention\": \"modified\", \"joints\": ["
        "{\"alpha\": 0, \"A\": 0, \"theta\": 0, \"D\": 0.467, \"offset\": 0, \"qmin\": -4, "
        "\"qmax\": 4},{\"alpha\": -1.5708, \"A\": 0, \"theta\": 0, \"D\": 0, \"offset\": -1.5708, "
        "\"qmin\": -1, \"qmax\": 1},{\"alpha\": -1.5708, \"A\": 0.009, \"theta\": 0, \"D\": 0, "
        "\"offset\": -1.5708, \"qmin\": -1, \"qmax\": 1}]}, \"jaw\": {\"qmin\": 0, \"qmax\": 1}}";
    OmPsm psm = om_psm_default(OM_PROGRASP, om_pose_identity());
    assert_ok(om_psm_parse_arm(arm, sizeof arm - 1, "arm.json", &psm));
    assert_ok(om_psm_parse_instrument(tool, sizeof tool - 1, "tool.json", &psm));
    const double zero[6] = {0}, q[6] = {2.1, 0.9, 0.27, -1, 0.4, -0.3};
    assert_near(om_psm_forward(&psm, zero).p.z, 0.48 - 0.467 - 0.009, 1e-12);
    double found[6];
    assert_ok(om_psm_inverse(&psm, om_psm_forward(&psm, q), q, found));
    for (int k = 0; k < 6; ++k) assert_near(found[k], q[k], 1e-9);
    assert_status(om_psm_parse_arm(tool, sizeof tool - 1, "tool.json", &psm), OM_UNAVAILABLE);
}

// A made file of that form, with more keys than are read: its wrist moves the tip.
static void a_made_instrument_is_read(void** state) {
    (void)state;
    static const char form[] =
        "/* -*- Mode: Javascript -*- */\n{\n    // see the manual\n    \"DH\": {\n"
        "        \"convention\": \"%s\",\n        \"joints\": [\n"
        "            {\"name\": \"roll\", \"alpha\": 0.0000, \"A\": 0.0000, \"theta\": 0.0000, \"D\": 0.4162, "
        "\"type\": \"revolute\", \"mode\": \"active\", \"offset\": 0.0000, \"qmin\": -4.0, // degrees\n"
        "\"qmax\": 4.5, \"ftmax\": 0.33},\n"
        "            {\"name\": \"wrist_pitch\", \"alpha\": -1.5708, \"A\": 0, \"theta\": 0, \"D\": 0, "
        "\"offset\": -1.5708, \"qmin\": -1.25, \"qmax\": 1.375},\n"
        "            {\"name\": \"wrist_yaw\", \"alpha\": -1.5708, \"A\": 0.0125, \"theta\": 0, \"D\": 0, "
        "\"offset\": -1.5708, \"qmin\": -1.125, \"qmax\": 1.0}\n        ]\n    },\n"
        "    \"jaw\": {\"qmin\": -0.5, \"qmax\": 1.5, \"ftmax\": 0.16},\n"
        "    \"coupling\": {\"ActuatorToJointPosition\": [[-1.5632, 0], [0, 1.0186]]} // not read\n}\n";
    static const double lo[3] = {-4, -1.25, -1.125}, hi[3] = {4.5, 1.375, 1};
    char text[2048];
    const char* path = temp_path("made_tool.json");
    OmPsm psm = om_psm_default(OM_PROGRASP, om_pose_identity());
    int n = snprintf(text, sizeof text, form, "modified");
    write_bytes(path, text, (size_t)n);
    assert_ok(om_psm_load_instrument(path, &psm));
    assert_near(psm.wrist, 0.0125, 0);
    for (int k = 0; k < 3; ++k) {
        assert_near(psm.q_min[3 + k], lo[k], 0);
        assert_near(psm.q_max[3 + k], hi[k], 0);
    }
    assert_true(psm.jaw_min == -0.5 && psm.jaw_max == 1.5);
    // The wrist's pitch axis is 0.4318 - 0.4162 m above the remote centre at zero. A turn by q takes the tip, 12.5 mm
    // away, from straight below along an arc.
    for (int k = 0; k < 4; ++k) {
        const double q[6] = {0, 0, 0, 0, 0.4 * k, 0};
        const OmVec3 p = om_psm_forward(&psm, q).p;
        assert_near(p.z, 0.0156 - 0.0125 * cos(q[4]), 1e-15);  // rounding
        assert_near(hypot(p.x, p.y), 0.0125 * sin(q[4]), 1e-15);
    }
    OmPsm before = psm;
    n = snprintf(text, sizeof text, form, "standard");
    write_bytes(path, text, (size_t)n);
    assert_status(om_psm_load_instrument(path, &psm), OM_UNAVAILABLE);
    assert_memory_equal(&psm, &before, sizeof psm);
    remove(path);
    assert_status(om_psm_load_instrument(path, &psm), OM_IO);
}

// Comments are blanks, slashes in names are not comments, other wrists are refused.
static void instruments_of_another_form_are_refused(void** state) {
    (void)state;
    static const char form[] =
        "/* \"a\" // */ {\"DH\": {\"convention\": \"modified\", \"joints\": [ // three\n"
        "{\"name\": \"a//b\", \"alpha\": 0, \"A\": 0, \"theta\": 0, \"D\": %g, \"offset\": 0, \"qmin\": -1, "
        "\"qmax\": 1},\n{\"alpha\": -1.5708, \"A\": 0, \"theta\": 0, \"D\": 0, \"offset\": -1.5708, \"qmin\": "
        "-1, \"qmax\": 1},\n{\"alpha\": -1.5708, \"A\": 0.01, \"theta\": 0, \"D\": 0, \"offset\": -1.5708, "
        "\"qmin\": -1, \"qmax\": %g}]}, \"jaw\": {\"qmin\": 0, \"qmax\": 1}}%s";
    char text[1024];
    OmPsm psm = om_psm_default(OM_PROGRASP, om_pose_identity());
    int n = snprintf(text, sizeof text, form, 0.4162, 1.0, " // end");
    assert_ok(om_psm_parse_instrument(text, (size_t)n, "x.json", &psm));
    assert_near(psm.wrist, 0.01, 0);
    n = snprintf(text, sizeof text, form, 0.3, 1.0, "");
    assert_status(om_psm_parse_instrument(text, (size_t)n, "x.json", &psm), OM_UNAVAILABLE);
    n = snprintf(text, sizeof text, form, 0.4162, -2.0, "");
    assert_status(om_psm_parse_instrument(text, (size_t)n, "x.json", &psm), OM_INVALID);
    n = snprintf(text, sizeof text, form, 0.4162, 1.0, "}");
    assert_status(om_psm_parse_instrument(text, (size_t)n, "x.json", &psm), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "x.json:4"));
}

// ---- instruments of four and five joints, and of other rows --------------------------------------------------------

typedef struct Made {  // rows of a file: alpha, A, theta, D, offset
    int n;
    double row[3][5];
    double tip[4][4];
    bool has_jaw;
} Made;

// A roll alone, a wrist that bends once beside the shaft, the same with a turned tip, and three joints with angles that
// no usual wrist has.
static const Made made[] = {
    {1, {{0, 0, 0, 0.42, 0}}, {{0, 1, 0, 0}, {-1, 0, 0, 0}, {0, 0, 1, 0.012}, {0, 0, 0, 1}}, false},
    {2,
     {{0, 0, 0, 0.4162, 0}, {-1.5708, 0.003, 0, 0.002, -1.5708}},
     {{0, 0, 1, 0.011}, {1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 0, 1}},
     true},
    {3,
     {{0, 0, 0, 0.467, 0}, {-1.2, 0.004, 0.1, 0.001, -1.5708}, {-1.5708, 0.0095, 0.2, 0, -1.5708}},
     {{0, -1, 0, 0.001}, {0, 0, 1, 0.002}, {-1, 0, 0, -0.003}, {0, 0, 0, 1}},
     true},
    {3,  // the usual one
     {{0, 0, 0, 0.4162, 0}, {-1.5708, 0, 0, 0, -1.5708}, {-1.5708, 0.0091, 0, 0, -1.5708}},
     {{0, -1, 0, 0}, {0, 0, 1, 0}, {-1, 0, 0, 0}, {0, 0, 0, 1}},
     true},
};
enum { NMADE = sizeof made / sizeof *made };

static OmPsm read_made(const Made* m) {
    char text[2000];
    int n = snprintf(text, sizeof text, "{\"DH\": {\"convention\": \"modified\", \"joints\": [");
    for (int k = 0; k < m->n; ++k)
        n += snprintf(
            text + n, sizeof text - (size_t)n,
            "%s{\"type\": \"revolute\", \"mode\": \"active\", \"alpha\": %g, \"A\": %g, \"theta\": %g, "
            "\"D\": %g, \"offset\": %g, \"qmin\": %g, \"qmax\": %g}",
            k ? ", " : "", m->row[k][0], m->row[k][1], m->row[k][2], m->row[k][3], m->row[k][4],
            k ? -1.3 : -4.5, k ? 1.25 : 4.5);
    n += snprintf(text + n, sizeof text - (size_t)n, "]}, \"tooltip_offset\": [");
    for (int r = 0; r < 4; ++r)
        n += snprintf(text + n, sizeof text - (size_t)n, "%s[%g, %g, %g, %g]", r ? ", " : "",
                      m->tip[r][0], m->tip[r][1], m->tip[r][2], m->tip[r][3]);
    n += snprintf(text + n, sizeof text - (size_t)n, "]%s}",
                  m->has_jaw ? ", \"jaw\": {\"qmin\": -0.1, \"qmax\": 1}" : "");
    OmPsm psm = om_psm_default(
        OM_PROGRASP, (OmPose){{0.02, -0.1, 0.11}, om_quat_axis_angle(om_vec3(-1, 0.3, 2), 1.1)});
    assert_ok(om_psm_parse_instrument(text, (size_t)n, "made.json", &psm));
    assert_int_equal(psm.njoint, 3 + m->n);
    assert_int_equal(psm.has_jaw, m->has_jaw);
    return psm;
}

static void multiply(double a[4][4], double b[4][4]) {
    double c[4][4] = {{0}};
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j)
            for (int k = 0; k < 4; ++k) c[i][j] += a[i][k] * b[k][j];
    memcpy(a, c, sizeof c);
}

// A row of the modified table as one matrix (Craig, eq. 3.6). Files write -1.5708 for a right angle.
static void multiply_row(double a[4][4], double alpha, double length, double theta, double d) {
    const double right = OM_PI / 2;
    if (fabs(fabs(alpha) - right) < 1e-4) alpha = copysign(right, alpha);
    const double st = sin(theta), ct = cos(theta), sa = sin(alpha), ca = cos(alpha);
    double m[4][4] = {{ct, -st, 0, length},
                      {st * ca, ct * ca, -sa, -sa * d},
                      {st * sa, ct * sa, ca, ca * d},
                      {0, 0, 0, 1}};
    multiply(a, m);
}

// The product of the matrices of a whole arm, in its base.
static void product(const Made* m, const double q[6], double a[4][4]) {
    const double h = OM_PI / 2;
    memset(a, 0, 16 * sizeof(double));
    for (int i = 0; i < 4; ++i) a[i][i] = 1;
    multiply_row(a, h, 0, q[0] + h, 0);
    multiply_row(a, -h, 0, q[1] - h, 0);
    multiply_row(a, h, 0, 0, q[2] - 0.4318);
    for (int k = 0; k < m->n; ++k) {
        const double* r = m->row[k];
        const double zero = fabs(r[2] + r[4] + h) < 1e-4 ? -h : r[2] + r[4];
        multiply_row(a, r[0], r[1], zero + q[3 + k], r[3]);
    }
    double tip[4][4];
    memcpy(tip, m->tip, sizeof tip);
    multiply(a, tip);
}

// A row in the wrong order, an offset that is not added, or a tip without its place would be noticed.
static void rows_are_the_products_of_their_matrices(void** state) {
    (void)state;
    OmRng rng = om_rng_init(11, 0);
    for (int i = 0; i < NMADE; ++i) {
        const OmPsm psm = read_made(&made[i]);
        assert_int_equal(psm.has_rows, i < 3);
        for (int n = 0; n < 200; ++n) {
            double q[6] = {0}, a[4][4];
            for (int k = 0; k < psm.njoint; ++k)
                q[k] = om_rng_range(&rng, psm.q_min[k], psm.q_max[k]);
            product(&made[i], q, a);
            const OmPose tip =
                om_pose_mul(om_pose_inverse(psm.pose_world_rcm), om_psm_forward(&psm, q));
            const OmMat3 r = om_quat_to_mat3(tip.q);
            const OmVec3 column[3] = {r.cx, r.cy, r.cz};
            for (int c = 0; c < 3; ++c)
                assert_near(om_distance(column[c], om_vec3(a[0][c], a[1][c], a[2][c])), 0, 1e-13);
            assert_near(om_distance(tip.p, om_vec3(a[0][3], a[1][3], a[2][3])), 0, 1e-13);
        }
    }
}

static void rows_have_their_jacobian(void** state) {
    (void)state;
    for (int i = 0; i < NMADE; ++i) {
        const OmPsm psm = read_made(&made[i]);
        double j[36], h = 1e-6, q[6] = {0.3, -0.2, 0.12, 0.5, -0.4, 0.6};
        for (int k = psm.njoint; k < 6; ++k) q[k] = 0;
        om_psm_jacobian(&psm, q, j);
        for (int k = 0; k < 6; ++k) {
            double lo[6], hi[6];
            memcpy(lo, q, sizeof lo);
            memcpy(hi, q, sizeof hi);
            lo[k] -= h, hi[k] += h;
            const OmPose a = om_psm_forward(&psm, lo), b = om_psm_forward(&psm, hi);
            const OmVec3 v = om_scale(0.5 / h, om_sub(b.p, a.p));
            OmQuat d = om_quat_mul(b.q, om_quat_conj(a.q));
            const double s = d.w < 0 ? -1 / h : 1 / h;
            const double fd[6] = {v.x, v.y, v.z, s * d.x, s * d.y, s * d.z};
            for (int r = 0; r < 6; ++r) assert_near(j[6 * r + k], fd[r], 1e-8);
        }
    }
}

// Inverse of forward, from joints near by and from zero. Of several solutions any may come: its tip is the wanted one.
static void rows_are_inverted(void** state) {
    (void)state;
    OmRng rng = om_rng_init(13, 0);
    for (int i = 0; i < NMADE; ++i) {
        const OmPsm psm = read_made(&made[i]);
        for (int n = 0; n < 40; ++n) {
            double q[6] = {0}, near[6] = {0}, back[6];
            for (int k = 0; k < psm.njoint; ++k) {
                const double way = psm.q_max[k] - psm.q_min[k];
                q[k] = om_rng_range(&rng, psm.q_min[k] + 0.02 * way, psm.q_max[k] - 0.02 * way);
                near[k] = q[k] + 0.01 * way * om_rng_range(&rng, -1, 1);
            }
            q[2] = om_rng_range(&rng, 0.05, 0.23);
            const OmPose tip = om_psm_forward(&psm, q);
            assert_ok(om_psm_inverse(&psm, tip, near, back));
            for (int k = 0; k < 6; ++k) assert_near(back[k], q[k], 1e-6);
            assert_ok(om_psm_inverse(&psm, tip, q_zero, back));
            const OmPose found = om_psm_forward(&psm, back);
            assert_near(om_distance(found.p, tip.p), 0, 1e-12);
            assert_near(om_quat_angle(found.q, tip.q), 0, 2e-7);
        }
    }
}

// Least squares and the closed form of the usual wrist find the same joints, and refuse the same limits.
static void rows_agree_with_the_closed_form(void** state) {
    (void)state;
    OmRng rng = om_rng_init(17, 0);
    const OmPsm usual = read_made(&made[3]);
    OmPsm rows = usual;
    const double h = OM_PI / 2;
    rows.has_rows = true;
    for (int k = 0; k < 3; ++k)
        rows.row[k] = (OmPsmRow){k ? -h : 0, made[3].row[k][1], k ? -h : 0, made[3].row[k][3]};
    rows.pose_last_tip.q =
        om_quat_from_mat3(om_mat3_cols(om_vec3(0, 0, -1), om_vec3(-1, 0, 0), om_vec3(0, 1, 0)));
    for (int n = 0; n < 90; ++n) {
        double q[6], a[6], b[6];
        for (int k = 0; k < 6; ++k) q[k] = om_rng_range(&rng, usual.q_min[k], usual.q_max[k]);
        q[2] = om_rng_range(&rng, 0.05, 0.23);
        if (n % 3 == 0) q[4] = 1.4;  // beyond its limit
        const OmPose tip = om_psm_forward(&usual, q);
        const OmStatus status = om_psm_inverse(&usual, tip, q_zero, a);
        assert_status(om_psm_inverse(&rows, tip, q_zero, b), status);
        for (int k = 0; status == OM_OK && k < 6; ++k) assert_near(b[k], a[k], 1e-6);
    }
}

// With fewer joints the strict inverse says how far the orientation is off, and the nearest one is as near as the best
// of a fine grid, at the same point.
static void what_a_short_wrist_does_not_reach_is_named(void** state) {
    (void)state;
    OmRng rng = om_rng_init(19, 0);
    for (int i = 0; i < 2; ++i) {
        OmPsm psm = read_made(&made[i]);
        psm.pose_world_rcm = om_pose_identity();
        for (int n = 0; n < 4; ++n) {
            const double roll = om_rng_range(&rng, -3, 3),
                         bend = i ? om_rng_range(&rng, -0.8, 0.8) : 0;
            const double from[6] = {om_rng_range(&rng, -0.6, 0.6), om_rng_range(&rng, -0.5, 0.5),
                                    0.15, roll, bend};
            OmPose wanted = om_psm_forward(&psm, from), reached;
            const OmVec3 axis = om_vec3(om_rng_range(&rng, -1, 1), om_rng_range(&rng, -1, 1),
                                        om_rng_range(&rng, -1, 1));
            wanted.q = om_quat_mul(wanted.q, om_quat_axis_angle(om_normalize(axis), 0.3));
            double q[6] = {7}, none[6] = {7};
            char words[80];
            assert_ok(om_psm_inverse_nearest(&psm, wanted, from, q, &reached));
            const double off = om_quat_angle(reached.q, wanted.q);
            assert_near(om_distance(om_psm_forward(&psm, q).p, wanted.p), 0, 1e-12);
            assert_near(om_quat_angle(om_psm_forward(&psm, q).q, reached.q), 0, 1e-7);
            // the grid: joints of roll and wrist; the tip is put to the point by yaw, pitch and insertion
            double least = 10;
            for (int a = 0; a <= 120; ++a)
                for (int b = 0; b <= (i ? 40 : 0); ++b) {
                    double t[6] = {
                        q[0], q[1], q[2], roll - 0.9 + 0.015 * a, i ? -1.3 + 0.06375 * b : 0, 0};
                    for (int k = 0; k < 6; ++k) {  // Newton's method in the position
                        double j[36];
                        om_psm_jacobian(&psm, t, j);
                        const OmVec3 e = om_sub(wanted.p, om_psm_forward(&psm, t).p);
                        const OmMat3 m =
                            om_mat3_cols(om_vec3(j[0], j[6], j[12]), om_vec3(j[1], j[7], j[13]),
                                         om_vec3(j[2], j[8], j[14]));
                        const double det = om_mat3_det(m);
                        t[0] += om_dot(e, om_cross(m.cy, m.cz)) / det;
                        t[1] += om_dot(m.cx, om_cross(e, m.cz)) / det;
                        t[2] += om_dot(m.cx, om_cross(m.cy, e)) / det;
                        if (om_norm(e) < 1e-9) break;
                    }
                    least = fmin(least, om_quat_angle(om_psm_forward(&psm, t).q, wanted.q));
                }
            assert_below(off, least + 1e-9);
            assert_below(least - off, i ? 8e-3 : 1e-3);  // the step of the grid
            if (off < 1e-3) continue;
            assert_status(om_psm_inverse(&psm, wanted, from, none), OM_INVALID);
            snprintf(words, sizeof words, "the arm has %d joints with this instrument", 4 + i);
            assert_non_null(strstr(om_error_message(), words));
            snprintf(words, sizeof words, "the nearest one %.2f degrees off", off * 180 / OM_PI);
            assert_non_null(strstr(om_error_message(), words));
            assert_near(none[0], 7, 0);
            assert_ok(om_psm_inverse_turned(&psm, wanted, off + 1e-6, from, none, &reached));
            assert_status(om_psm_inverse_turned(&psm, wanted, off - 1e-6, from, q, &reached),
                          OM_INVALID);
        }
    }
}

static void rows_that_are_refused(void** state) {
    (void)state;
    static const struct {
        const char *text, *words;
        OmStatus status;
    } bad[] = {
        {"{\"DH\": {\"convention\": \"modified\", \"joints\": []}}", "has 0 joints",
         OM_UNAVAILABLE},
        {"{\"DH\": {\"convention\": \"modified\", \"joints\": [1, 2, 3, 4]}}", "has 4 joints",
         OM_UNAVAILABLE},
        {"{\"DH\": {\"convention\": \"modified\", \"joints\": [{\"alpha\": 0, \"A\": 0, \"theta\": 0, \"D\": 0.4, "
         "\"offset\": 0, \"qmin\": -1, \"qmax\": 1}]}}",
         "no \"tooltip_offset\"", OM_INVALID},
        {"{\"DH\": {\"convention\": \"modified\", \"joints\": [{\"alpha\": 0, \"A\": 0, \"theta\": 0, \"D\": 0.4, "
         "\"offset\": 0, \"qmin\": -1, \"qmax\": 1}]}, \"tooltip_offset\": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, "
         "-1, 0], [0, 0, 0, 1]]}",
         "has no rotation", OM_INVALID},
        {"{\"DH\": {\"convention\": \"modified\", \"joints\": [{\"alpha\": 0.1, \"A\": 0, \"theta\": 0, \"D\": 0.4, "
         "\"offset\": 0, \"qmin\": -1, \"qmax\": 1}]}}",
         "only a roll about the shaft", OM_UNAVAILABLE},
        {"{\"DH\": {\"convention\": \"modified\", \"joints\": [{\"type\": \"prismatic\", \"alpha\": 0, \"A\": 0, "
         "\"theta\": 0, \"D\": 0.4, \"offset\": 0, \"qmin\": -1, \"qmax\": 1}]}}",
         "roll is prismatic", OM_UNAVAILABLE},
    };
    for (size_t k = 0; k < sizeof bad / sizeof *bad; ++k) {
        OmPsm psm = om_psm_default(OM_PROGRASP, om_pose_identity()), before = psm;
        assert_status(om_psm_parse_instrument(bad[k].text, strlen(bad[k].text), "x.json", &psm),
                      bad[k].status);
        if (!strstr(om_error_message(), bad[k].words))
            fail_msg("\"%s\" lacks \"%s\"", om_error_message(), bad[k].words);
        assert_memory_equal(&psm, &before, sizeof psm);
    }
}

// An arm that had a short wrist has the usual one again, and what is drawn is finite.
static void a_usual_instrument_after_rows(void** state) {
    (void)state;
    OmSurface surface = {0};
    OmPsm psm = read_made(&made[0]);
    assert_ok(om_psm_surface(&psm, (double[6]){0, 0, 0.1}, 0, &surface));
    for (int i = 0; i < 3 * surface.nvert; ++i) assert_true(isfinite(surface.x[i]));
    om_surface_done(&surface);
    const OmPose base = psm.pose_world_rcm;
    assert_ok(om_psm_load_instrument(test_data("dvrk/PROGRASP_FORCEPS_400093.json"), &psm));
    const OmPsm usual = om_psm_default(OM_PROGRASP, base);
    assert_true(psm.njoint == 6 && psm.has_jaw && !psm.has_rows && psm.wrist == usual.wrist);
    assert_near(om_distance(om_psm_forward(&psm, q_a).p, om_psm_forward(&usual, q_a).p), 0, 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(forward_matches_published_values),
        cmocka_unit_test(limits_are_the_robots),
        cmocka_unit_test(jacobian_matches_finite_differences),
        cmocka_unit_test(inverse_undoes_forward),
        cmocka_unit_test(what_is_accepted_is_reached),
        cmocka_unit_test(the_wrist_turns_where_a_joint_forbids),
        cmocka_unit_test(what_is_out_of_reach_is_named),
        cmocka_unit_test(efforts_do_the_work_of_the_tip),
        cmocka_unit_test(the_drawn_tool_is_closed_and_ends_at_the_tip),
        cmocka_unit_test(capsules_enclose_the_drawn_tool),
        cmocka_unit_test(the_drawing_follows_the_joints),
        cmocka_unit_test(instruments_are_read_from_files),
        cmocka_unit_test(rows_are_the_products_of_their_matrices),
        cmocka_unit_test(rows_have_their_jacobian),
        cmocka_unit_test(rows_are_inverted),
        cmocka_unit_test(rows_agree_with_the_closed_form),
        cmocka_unit_test(what_a_short_wrist_does_not_reach_is_named),
        cmocka_unit_test(rows_that_are_refused),
        cmocka_unit_test(a_usual_instrument_after_rows),
        cmocka_unit_test(a_longer_arm),
        cmocka_unit_test(a_made_instrument_is_read),
        cmocka_unit_test(instruments_of_another_form_are_refused),
        cmocka_unit_test(refused_memory_leaks_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
