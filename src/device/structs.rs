//! Parameters are declared once: [`device_struct!`](crate::device_struct) makes the Rust struct, its OpenCL C text and its offsets from one
//! declaration. Fields are 4-byte scalars and arrays of them: OpenCL guarantees nothing about the layout of `float3` in a struct that the host and
//! the device share.

/// A type that may stand in a device struct.
pub trait DeviceField {
    /// Its OpenCL C declaration, given the field's name.
    fn declare(name: &str) -> String;
}

macro_rules! scalar {
    ($rust:ty, $opencl:literal) => {
        impl DeviceField for $rust {
            fn declare(name: &str) -> String {
                format!(concat!($opencl, " {};"), name)
            }
        }
        impl<const N: usize> DeviceField for [$rust; N] {
            fn declare(name: &str) -> String {
                format!(concat!($opencl, " {}[{}];"), name, N)
            }
        }
    };
}
scalar!(f32, "float");
scalar!(i32, "int");
scalar!(u32, "uint");

/// A struct that the host and the device share.
pub trait DeviceStruct: bytemuck::Pod {
    /// Its name in Rust and in OpenCL C.
    const NAME: &'static str;
    /// The name and byte offset of every field, in order.
    fn offsets() -> Vec<(&'static str, usize)>;
    /// The OpenCL C `typedef`.
    fn opencl_text() -> String;
    /// The layout, as data.
    const LAYOUT: Layout =
        Layout { name: Self::NAME, offsets: Self::offsets, size: size_of::<Self>(), opencl_text: Self::opencl_text };
}

/// The layout of a struct that the host and the device share: a [`DeviceStruct`] as data.
#[derive(Debug, Clone, Copy)]
pub struct Layout {
    /// Its name in Rust and in OpenCL C.
    pub name: &'static str,
    /// The name and byte offset of every field, in order.
    pub offsets: fn() -> Vec<(&'static str, usize)>,
    /// Its size in bytes.
    pub size: usize,
    /// The OpenCL C `typedef`.
    pub opencl_text: fn() -> String,
}

/// Declares a struct for host and device: `device_struct! { /// words pub struct Name { field: [f32; 3], … } }`.
#[macro_export]
macro_rules! device_struct {
    ($(#[$meta:meta])* pub struct $name:ident { $($(#[$field_meta:meta])* pub $field:ident: $type:ty,)* }) => {
        $(#[$meta])*
        #[repr(C)]
        #[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
        pub struct $name { $($(#[$field_meta])* pub $field: $type,)* }

        impl Default for $name {
            fn default() -> Self {
                bytemuck::Zeroable::zeroed()
            }
        }

        impl $crate::device::structs::DeviceStruct for $name {
            const NAME: &'static str = stringify!($name);
            fn offsets() -> Vec<(&'static str, usize)> {
                vec![$((stringify!($field), std::mem::offset_of!($name, $field)),)*]
            }
            fn opencl_text() -> String {
                let mut text = String::from("typedef struct {\n");
                $(text += &format!("    {}\n", <$type as $crate::device::structs::DeviceField>::declare(stringify!($field)));)*
                text + "} " + stringify!($name) + ";\n"
            }
        }
    };
}

/// The most lights that a view has.
pub const LIGHTS: usize = 4;
/// The most clipping planes that a view has: eight, and the six faces of a crop box.
pub const PLANES: usize = 14;

device_struct! {
    /// The camera, the image and the pass, for every view kernel. See `kernels/shared/camera.h`.
    pub struct View {
        /// The image's (0, 0) corner on the plane near the volume, index units.
        pub plane: [f32; 3],
        /// One pixel to the right on that plane, index units.
        pub right: [f32; 3],
        /// One pixel down on that plane, index units.
        pub down: [f32; 3],
        /// The displacement from the eye to `plane`, index units (orthographic: the view direction).
        pub towards: [f32; 3],
        /// The same in world units.
        pub towards_world: [f32; 3],
        /// One pixel to the right, world units.
        pub right_world: [f32; 3],
        /// One pixel down, world units.
        pub down_world: [f32; 3],
        /// Distance from the eye to the plane, world units (orthographic only).
        pub t_eye: f32,
        /// -1 for perspective, 0 for orthographic: a lane mask.
        pub perspective: i32,
        /// Voxels along x, y, z.
        pub dims: [i32; 3],
        /// Width of this pass in its own pixels.
        pub width: i32,
        /// Height of this pass in its own pixels.
        pub height: i32,
        /// Width of the full image, by which pixels are numbered for the random numbers.
        pub full_width: i32,
        /// The stride: this pass renders every `stride`-th pixel of the full image.
        pub stride: i32,
        /// Number of the first beam of this launch.
        pub first_beam: i32,
        /// Steps that a work-item may take in this launch; 0 for no bound.
        pub most_steps: u32,
        /// 1 if the work-items resume the state that the launch before has left.
        pub resumed: i32,
        /// Number of the sample in its pixel, from 0; of the first one, if several lie side by side.
        pub sample: i32,
        /// Samples that each pixel of the film has already.
        pub held: i32,
        /// The samples of a pixel lie side by side in the film of a probe: 2^`batch[0]` by 2^`batch[1]`.
        pub batch: [i32; 2],
        /// The pixel of the full image at which the clusters of a probe begin; else 0.
        pub origin: [i32; 2],
        /// A probe has clusters of 2^`cluster` by 2^`cluster` pixels beside each other, every `stride` pixels.
        pub cluster: i32,
        /// 1 if each pixel has places of its own, as a probe's.
        pub own_places: i32,
        /// The keys of the scrambles of both sides, by the seed.
        pub place_keys: [u32; 2],
        /// What moves the places in each quarter of both sides, so that the first four are as they should be.
        pub place_moves: [u32; 8],
        /// What bends the places of each octave of samples, so that their mean is the centre.
        pub place_bends: [f32; 16],
        /// The film's number. Each film has random numbers of its own.
        pub stream: u32,
        /// The request's seed.
        pub seed: [u32; 2],
        /// Sample offset: the point of a pixel that the ray goes through, in full-size pixels.
        pub offset: [f32; 2],
        /// The step along the ray, world units.
        pub step: f32,
        /// 1 if samples lie at random positions within their steps, 0 if all lie at `place`.
        pub jittered: i32,
        /// The position of samples that are not jittered within their steps, from 0 to 1.
        pub place: f32,
        /// The number of clipping planes.
        pub planes: i32,
        /// Four numbers a plane, index units: a x + b y + c z + d is not negative where the volume is shown.
        pub plane_index: [f32; 4 * PLANES],
        /// The matrix, row by row, from a gradient in index units to the world.
        pub world_gradient_from_index: [f32; 9],
        /// The squared factor from a gradient's magnitude in index units to the world, if it is the same in all directions; else 0.
        pub isotropic_squared: f32,
        /// The squared magnitude of a gradient (raw values per world unit) below which its direction is unknown.
        pub flat_squared: f32,
        /// Weight of light from everywhere.
        pub ambient: f32,
        /// Exponent of the highlight.
        pub shininess: f32,
        /// The number of lights.
        pub lights: i32,
        /// The directions towards the lights, world space, unit length.
        pub light_direction: [f32; 3 * LIGHTS],
        /// The covectors whose product with a gradient in index units is that of `light_direction` with the gradient in the world.
        pub light_index: [f32; 3 * LIGHTS],
        /// The linear colour of each light times the weight of Lambert's term.
        pub lambert: [f32; 3 * LIGHTS],
        /// The linear colour of each light times the weight of the highlight.
        pub highlight: [f32; 3 * LIGHTS],
    }
}
