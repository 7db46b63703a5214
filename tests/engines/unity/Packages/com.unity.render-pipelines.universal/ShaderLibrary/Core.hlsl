// Stubs of what HairloomCards.hlsl uses from Unity's file of this name, for a compiler without Unity.
#define CBUFFER_START(name) cbuffer name {
#define CBUFFER_END };
#define UNITY_REVERSED_Z 1
#define UNITY_NEAR_CLIP_VALUE 1.0
#define half4 float4
#define UNITY_VERTEX_INPUT_INSTANCE_ID uint instanceID : SV_InstanceID;
#define UNITY_VERTEX_OUTPUT_STEREO nointerpolation uint eye : TEXCOORD7;
#define UNITY_SETUP_INSTANCE_ID(corner) eye_now = corner.instanceID & 1u
#define UNITY_INITIALIZE_VERTEX_OUTPUT_STEREO(result) result.eye = eye_now
#define UNITY_SETUP_STEREO_EYE_INDEX_POST_VERTEX(card) eye_now = card.eye

static uint eye_now;

float4x4 object_to_world, world_to_clip;
float3 camera;
float4 unity_LODFade, unity_FogColor;

float3 TransformObjectToWorld(float3 place) { return mul(object_to_world, float4(place, 1.0)).xyz; }
float3 TransformObjectToWorldNormal(float3 normal) { return mul((float3x3)object_to_world, normal); }
float3 TransformObjectToWorldDir(float3 direction) { return mul((float3x3)object_to_world, direction); }
float4 TransformWorldToHClip(float3 place) { return mul(world_to_clip, float4(place, 1.0)); }
float3 GetWorldSpaceNormalizeViewDir(float3 place) { return normalize(camera - place); }
float2 GetNormalizedScreenSpaceUV(float4 position) { return position.xy; }
float ComputeFogFactor(float depth) { return depth; }
float3 MixFog(float3 color, float fog) { return lerp(unity_FogColor.xyz, color, saturate(fog)); }
