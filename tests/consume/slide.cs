// A user's program in C#: slide.c by P/Invoke, with the declarations that it needs. Prints the line that slide.c prints.
using System;
using System.Globalization;
using System.Runtime.InteropServices;

[StructLayout(LayoutKind.Sequential)]
struct SnapLength {
  public uint law, table_size;
  public double first_parameter, second_parameter;
  public IntPtr table;
}

[StructLayout(LayoutKind.Sequential)]
struct Material {
  public UIntPtr struct_size;
  public double bristle_stiffness, bristle_damping, viscous_friction, stribeck_velocity, normal_stiffness;
  public double asperity_height_deviation;
  public SnapLength snap_length;
  public uint snap_rule, damper_decay;
  public double residual_length, shared_renewal;
  public uint ageing_form, reserved;
  public double ageing_strength, ageing_time, speed_strengthening, strengthening_speed, drop;
}

[StructLayout(LayoutKind.Sequential)]
struct Coefficients {
  public UIntPtr struct_size;
  public double kinetic, peak, presliding_length, bristles_per_newton, damping_per_newton, viscous_friction;
  public double stribeck_velocity;
  public uint law, rule, damper_decay, reserved;
  public double residual_share, shared_renewal, kinetic_speed, fall_per_decade, growth_per_decade, ageing_time;
  public uint ageing_form, reserved_too;
  public double speed_strengthening, strengthening_speed, spread, drop;
}

[StructLayout(LayoutKind.Sequential)]
struct PatchOptions {
  public UIntPtr struct_size;
  public double max_normal_load;
  public ulong key;
  public uint bristles, seed;
  public int axes;
  public uint outputs, precision, population;
  public double resolution, lay_angle, lay_limit_ratio, lay_stiffness_ratio, lay_to_over_fro;
}

[StructLayout(LayoutKind.Sequential)]
struct Motion {
  public ulong id;
  public double displacement_x, displacement_y, normal_load;
  public ulong has_velocity;
  public double velocity_x, velocity_y;
}

[StructLayout(LayoutKind.Sequential)]
struct Response {
  public ulong id;
  public uint status, reserved;
  public double end_x, end_y, elastic_x, elastic_y, damper_x, damper_y, mean_x, mean_y;
  public double stiffness, damping, force_limit, dissipated, contact_loss, damper_work;
  public ulong snaps;
}

static class Slide {
  const string library = "libbristle";  // name without ending: libbristle.dll, libbristle.so or libbristle.dylib
  const uint rule_keep = 1;

  [DllImport(library)] static extern IntPtr bristle_version();
  [DllImport(library)] static extern IntPtr bristle_last_error();
  [DllImport(library)] static extern int bristle_init_coefficients(out Coefficients c, UIntPtr size);
  [DllImport(library)] static extern int bristle_init_material(out Material m, UIntPtr size);
  [DllImport(library)] static extern int bristle_init_patch_options(out PatchOptions o, UIntPtr size);
  [DllImport(library)] static extern int bristle_material_from_coefficients(ref Coefficients c, ref Material m);
  [DllImport(library)] static extern int bristle_create(IntPtr options, out IntPtr batch);
  [DllImport(library)] static extern int bristle_add(IntPtr batch, ref Material m, ref PatchOptions o, out ulong id);
  [DllImport(library)] static extern int bristle_warm_up(IntPtr batch);
  [DllImport(library)] static extern int bristle_step(IntPtr batch, double dt_s, ref Motion motions, UIntPtr motion_size,
      out Response responses, UIntPtr response_size, UIntPtr count, IntPtr report);
  [DllImport(library)] static extern ulong bristle_state_hash(IntPtr batch, ulong id);
  [DllImport(library)] static extern void bristle_destroy(IntPtr batch);

  static UIntPtr SizeOf<T>() { return (UIntPtr)(uint)Marshal.SizeOf(typeof(T)); }

  static void Check(int result) {
    if (result != 0) throw new Exception(Marshal.PtrToStringAnsi(bristle_last_error()));
  }

  static void Main() {
    Coefficients coefficients;
    Material material;
    PatchOptions options;
    IntPtr batch;
    ulong tip;
    Check(bristle_init_coefficients(out coefficients, SizeOf<Coefficients>()));
    Check(bristle_init_material(out material, SizeOf<Material>()));
    Check(bristle_init_patch_options(out options, SizeOf<PatchOptions>()));
    coefficients.kinetic = 0.40;
    coefficients.peak = 0.46;
    coefficients.rule = rule_keep;
    coefficients.residual_share = coefficients.shared_renewal = 0.0;
    options.max_normal_load = 4.0;
    options.axes = 1;
    Check(bristle_material_from_coefficients(ref coefficients, ref material));
    Check(bristle_create(IntPtr.Zero, out batch));
    Check(bristle_add(batch, ref material, ref options, out tip));
    Check(bristle_warm_up(batch));
    double peak = 0.0;
    var response = new Response();
    for (int tick = 1; tick <= 100; ++tick) {
      var motion = new Motion { id = tip, displacement_x = 2e-6, normal_load = 1.0 };
      bristle_step(batch, 1e-3, ref motion, SizeOf<Motion>(), out response, SizeOf<Response>(), (UIntPtr)1u,
          IntPtr.Zero);
      peak = Math.Max(peak, -response.end_x);
    }
    Console.Write(string.Format(CultureInfo.InvariantCulture,
        "bristle {0}: peak {1:F9} N, in the end {2:F9} N, state {3:x16}\n",
        Marshal.PtrToStringAnsi(bristle_version()), peak, -response.end_x, bristle_state_hash(batch, 0)));
    bristle_destroy(batch);
  }
}
