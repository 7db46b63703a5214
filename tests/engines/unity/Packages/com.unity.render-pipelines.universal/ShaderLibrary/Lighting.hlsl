// Stubs of what HairloomCards.hlsl uses from Unity's file of this name, for a compiler without Unity.
struct Light
{
    float3 direction;
    float3 color;
    float distanceAttenuation;
    float shadowAttenuation;
};

struct InputData
{
    float3 positionWS;
    float2 normalizedScreenSpaceUV;
};

float4 lights[16];
uint light_count;

float4 _ShadowBias;  // from Shadows.hlsl, which this file includes

float3 ApplyShadowBias(float3 place, float3 normal, float3 to_light)
{
    float slope = 1.0 - saturate(dot(to_light, normal));
    return place + to_light * _ShadowBias.x + normal * (slope * _ShadowBias.y);
}

float4 TransformWorldToShadowCoord(float3 place) { return float4(place, 1.0); }
float3 SampleSH(float3 normal) { return normal; }

Light light_of(uint number)
{
    Light light;
    light.direction = lights[2 * number].xyz;
    light.color = lights[2 * number + 1].xyz;
    light.distanceAttenuation = lights[2 * number].w;
    light.shadowAttenuation = lights[2 * number + 1].w;
    return light;
}

Light GetMainLight(float4 shadow) { return light_of(0); }
Light GetAdditionalLight(uint number, float3 place, half4 shadow) { return light_of(number + 1); }
uint GetAdditionalLightsCount() { return light_count; }
#if defined(_FORWARD_PLUS)
#define USE_FORWARD_PLUS 1
#elif defined(_CLUSTER_LIGHT_LOOP)
#define USE_CLUSTER_LIGHT_LOOP 1
#endif
#if USE_FORWARD_PLUS || USE_CLUSTER_LIGHT_LOOP  // suns come first, and clusters contain only lamps
#define URP_FP_DIRECTIONAL_LIGHTS_COUNT sun_count
#define MAX_VISIBLE_LIGHTS 256
uint sun_count;
#define LIGHT_LOOP_BEGIN(count) for (uint lightIndex = sun_count; lightIndex < light_count; ++lightIndex) {
#else
#define LIGHT_LOOP_BEGIN(count) for (uint lightIndex = 0u; lightIndex < count; ++lightIndex) {
#endif
#define LIGHT_LOOP_END }
